"""Machine files: found by path or name, read, and written so that they read back the same."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import tomli_w

from corexy_fmi.bundled import bundled_folder
from corexy_fmi.effects.api import Effect
from corexy_fmi.errors import InputError
from corexy_fmi.files import write_beside
from corexy_fmi.machine.check import machine_from
from corexy_fmi.machine.laws import LARGEST
from corexy_fmi.machine.record import FREE_FORM, EffectUse, FreeForm, Machine
from corexy_fmi.nearest import nearest


def models_folder() -> Path:
    """Folder of the bundled machines."""
    return bundled_folder("models")


def machine_names() -> list[str]:
    """Names of the bundled machines."""
    return sorted(path.parent.name for path in models_folder().glob("*/machine.toml"))


def load_machine(path_or_name: str | Path, effects: Mapping[str, Effect] | None = None) -> Machine:
    """The machine of a file, of a folder that holds machine.toml, or of a bundled name.

    ``effects`` are a user's own, known beside the catalogue's.
    Raises InputError, naming file and key, for what cannot be read, an unknown key or effect, a
    value of the wrong kind or out of bounds.
    """
    path = machine_path(path_or_name)
    return machine_from(_document(path), str(path), _name(path), effects)


def machine_path(path_or_name: str | Path) -> Path:
    """The file that is meant; a bundled name is one whatever stands here, ./NAME is a file.

    Raises InputError for an empty name, and one that is neither.
    """
    path, known = Path(path_or_name), machine_names()
    if path_or_name in known:
        return models_folder() / path_or_name / "machine.toml"
    if not str(path_or_name):
        raise InputError("machine: found no name, expected a file or a bundled machine")
    if path.is_dir() and (path / "machine.toml").is_file():
        return path / "machine.toml"
    if path.exists() or path.suffix:
        return path
    hint = nearest(str(path_or_name), known)
    raise InputError(
        f"machine {str(path_or_name)!r}: no such file or bundled machine, "
        f"expected a file or one of {', '.join(known)}{hint}"
    )


def machine_to_toml(machine: Machine) -> str:
    """The machine as text that `load_machine` reads back to an equal machine."""
    head = {key: getattr(machine, key) for key in ("name", "topology", "drive", "fidelity")}
    if machine.surrogate:
        head["surrogate"] = machine.surrogate
    document: dict[str, dict[str, Any]] = {"machine": head}
    if machine.controller is not None:
        gains = asdict(machine.controller)
        if machine.controller.rate_weight == 1.0:
            del gains["rate_weight"]
        document["controller"] = _floats(gains)
    laws = [_effect_text(use) for use in machine.effects]
    laws += [_free_form_text(law) for law in machine.free_forms]
    return "\n".join([tomli_w.dumps(document), _parameters_text(machine), *laws])


def save_machine(machine: Machine, path: str | Path) -> None:
    """Write machine.toml, beside its place first; raises InputError where that is impossible."""
    with write_beside(Path(path)) as beside:
        beside.write_text(machine_to_toml(machine), encoding="utf-8", newline="\n")


def _parameters_text(machine: Machine) -> str:
    """One line for each nominal parameter, with its symbol and unit."""
    lines = ["[parameters]"]
    for known in machine.kind.parameters:
        value, prior = machine.parameters[known.name], machine.rel_std[known.name]
        pair = f"{{value = {float(value)!r}, rel_std = {float(prior)!r}}}"
        lines.append(f"{known.name} = {pair}  # {known.symbol} [{known.unit}]")
    return "\n".join(lines) + "\n"


def _effect_text(use: EffectUse) -> str:
    numbers = ", ".join(f"{name} = {float(value)!r}" for name, value in use.parameters.items())
    head = tomli_w.dumps({"name": use.name, "location": use.location})
    return f"[[effects]]\n{head}parameters = {{{numbers}}}\n"


def _free_form_text(law: FreeForm) -> str:
    head = {"name": FREE_FORM, "location": law.location, "argument": law.argument}
    head |= {} if law.acts == "force" else {"acts": law.acts}
    more = {key: float(getattr(law, key)) for key in LARGEST if getattr(law, key)}
    numbers = {"knots": list(map(float, law.knots)), "values": list(map(float, law.values))}
    return f"[[effects]]\n{tomli_w.dumps({**head, **more, **numbers})}"


def _floats(numbers: dict[str, Any]) -> dict[str, float]:
    return {name: float(value) for name, value in numbers.items()}


def _name(path: Path) -> str:
    """Name of a machine whose file gives none."""
    return path.parent.name if path.name == "machine.toml" else path.stem


def _document(path: Path) -> dict[str, Any]:
    """The parsed TOML."""
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path}: {reason}, expected a machine file (TOML)") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text, expected a machine file (TOML)") from error
    except (ValueError, RecursionError) as error:  # TOML's own is a ValueError
        raise InputError(f"{path}: not TOML: {error}, expected a machine file") from error
