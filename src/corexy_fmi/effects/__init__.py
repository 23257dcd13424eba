"""The catalogue: every file of this folder that holds an ``EFFECT``, in order of its name."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import traceback
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from corexy_fmi.effects.api import Effect
from corexy_fmi.errors import InputError


@cache
def catalogue() -> dict[str, Effect]:
    """All bundled effects by name."""
    names = sorted(m.name for m in pkgutil.iter_modules(__path__) if m.name != "api")
    modules = [importlib.import_module(f"{__name__}.{name}") for name in names]
    return {module.EFFECT.name: module.EFFECT for module in modules}


def own_effects(file: Path | None) -> dict[str, Effect]:
    """A user's own effect by its name, or nothing without a file; raises as `load_file`."""
    return {effect.name: effect for effect in [load_file(file)]} if file else {}


def load_file(path: Path) -> Effect:
    """A user's own effect from one Python file; the file is executed.

    Raises InputError where the file cannot be loaded, holds no ``EFFECT``, or takes a bundled name.
    """
    spec = importlib.util.spec_from_file_location(f"corexy_user_effect_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: not a Python file, expected one that defines EFFECT")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # whatever a user's own code raises
        told = f"cannot be loaded as an effect: {type(error).__name__}: {error}"
        raise InputError(f"{path}: {_line(error, path)}{told}, expected a Python file") from error
    if not hasattr(module, "EFFECT"):
        raise InputError(f"{path}: EFFECT is missing, expected an instance of Effect")
    effect = module.EFFECT
    if not isinstance(effect, Effect):
        raise InputError(f"{path}: EFFECT: found {effect!r:.60}, expected an instance of Effect")
    if effect.name in catalogue():
        raise InputError(f"{path}: name {effect.name!r} is a bundled effect's, expected a new one")
    _check(effect, str(path))
    return effect


def _line(error: BaseException, path: Path) -> str:
    """Where in a file the error rose last, as a beginning of its message; nothing elsewhere."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if Path(frame.filename) == path.absolute()]
    return f"line {lines[-1]}: " if lines else ""


def _check(effect: Effect, where: str) -> None:
    """Raises InputError for names, places and parameters that the kernel cannot have."""
    for name in (effect.name, *(p.name for p in effect.parameters), *effect.memory):
        if not str(name).isidentifier():
            raise InputError(f"{where}: name {name!r}, expected a word of letters, digits and _")
    if not isinstance(effect.locations, Mapping) or not effect.locations:
        raise InputError(
            f"{where}: locations: found {effect.locations!r}, expected a table of places by name, "
            "such as AXES"
        )
    if not any(p.size for p in effect.parameters):
        raise InputError(f"{where}: no parameter with size=True, expected what switches it off")
    for p in effect.parameters:
        if not p.lower <= p.upper:
            raise InputError(
                f"{where}: parameter {p.name}: found bounds {p.lower:g} to {p.upper:g}, "
                "expected the lower one first"
            )
