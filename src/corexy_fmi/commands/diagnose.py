"""``corexy diagnose``: locate, name, model and prove what the model lacks."""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from corexy_fmi.commands.places import folder_place, keep_apart, same_file
from corexy_fmi.commands.screen import (
    EffectsOption,
    JobsOption,
    JsonOption,
    assumed_machine,
    cores,
    label,
    progress,
    say,
    say_json,
)
from corexy_fmi.commands.verdict import show_verdict
from corexy_fmi.effects import catalogue, own_effects
from corexy_fmi.errors import InputError
from corexy_fmi.files import RESULT_FILES, write_folder
from corexy_fmi.machine import Machine, load_machine, save_machine
from corexy_fmi.recording import Recording, check_drive, read_recording, write_recording

HOLDOUT, FMU = "--holdout", "CoreXY.fmu"
SLOW = "no C compiler: what the cache does not hold runs in Python, thousands of times slower"


class ManyHoldouts(TyperCommand):
    """Lets ``--holdout A.csv B.csv`` take every file up to the next option."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Name the option before each of its files, as the parser wants it."""
        return super().parse_args(ctx, expand_holdouts(args))


def expand_holdouts(args: list[str]) -> list[str]:
    """``--holdout A B`` as ``--holdout A --holdout B``."""
    expanded: list[str] = []
    taking = fresh = False
    for argument in args:
        if taking and not argument.startswith("-"):
            expanded += [argument] if fresh else [HOLDOUT, argument]
            fresh = False
            continue
        taking = fresh = argument == HOLDOUT
        taking = taking or argument.startswith(f"{HOLDOUT}=")
        expanded.append(argument)
    return expanded


def diagnose(
    train: Annotated[list[Path], typer.Argument(metavar="TRAIN.csv...", help="Recordings.")],
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", help="Folder for results.", parser=folder_place),
    ],
    holdout: Annotated[
        list[Path] | None,
        typer.Option(metavar="H.csv...", help="Recordings that only judge; one or more files."),
    ] = None,
    machine: Annotated[
        str | None, typer.Option(metavar="FILE", help="Machine file or name; else yin2018.")
    ] = None,
    effects: EffectsOption = None,
    jobs: JobsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say where recordings and model differ, which physics is missing, and prove it.

    Writes diagnosis.json, report.html, machine.toml and CoreXY.fmu into the folder. Without
    --holdout the last 30 % of every recording is kept back to judge.

    Examples:

    corexy diagnose run1.csv run2.csv --holdout run3.csv --machine printer.toml --out result

    corexy diagnose run.csv --out result --json
    """
    from corexy_fmi.kernel.compiler import MISSING, has_compiler

    began = time.perf_counter()
    if not has_compiler():
        print(SLOW, file=sys.stderr)
    trains, holdouts = read_all(train, holdout or [])
    chosen = chosen_machine(machine, effects, [*trains, *holdouts])
    results = [out / name for name in RESULT_FILES]
    keep_apart(results, [*train, *(holdout or []), effects], machine)
    with progress() as move, write_folder(out, RESULT_FILES) as folder:
        document = write_diagnosis(
            folder,
            trains,
            holdouts,
            chosen,
            machine is None,
            jobs or cores(),
            effects,
            move,
            began,
        )
        built = (folder / FMU).exists()
    if not built:
        print(f"{FMU} was not built: {MISSING}", file=sys.stderr)
    if as_json:
        say_json(document)
        return
    label(chosen)
    show_verdict(document)
    for name in ("report.html", "diagnosis.json", "machine.toml", FMU):
        if (out / name).exists():
            say(f"{out / name}")
    if document["next_experiment"]:
        say(f"next: {document['next_experiment']['why']}")
        say(f"{out / document['next_experiment']['program']}")


def write_diagnosis(
    folder: Path,
    trains: list[Recording],
    holdouts: list[Recording],
    machine: Machine,
    assumed: bool,
    jobs: int,
    effects_file: Path | None,
    move: Callable[[str, float], None] | None,
    began: float,
) -> dict[str, Any]:
    """Diagnose and write the four files of a result into a folder; returns the document.

    Without a compiler there is no FMU of what the cache does not hold.
    """
    from corexy_fmi.engine import diagnose as find
    from corexy_fmi.fmu.build import build_fmu
    from corexy_fmi.kernel.compiler import NoCompilerError
    from corexy_fmi.report import write_report

    found = find(
        trains,
        holdouts,
        machine,
        machine_assumed=assumed,
        jobs=jobs,
        effects_file=effects_file,
        progress=move,
    )
    document = {**found.document, "seconds": round(time.perf_counter() - began, 3)}
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    (folder / "diagnosis.json").write_text(text + "\n", encoding="utf-8")
    write_report(folder / "report.html", document, found.evidence)
    save_machine(found.machine, folder / "machine.toml")
    if found.experiment is not None:
        write_recording(found.experiment.order, folder / found.experiment.order.name)
    with suppress(NoCompilerError):
        build_fmu(folder, found.machine, effects=catalogue() | own_effects(effects_file))
    return document


def read_all(train: list[Path], holdout: list[Path]) -> tuple[list[Recording], list[Recording]]:
    """Both lists of recordings; files of equal names are told apart by their folders.

    Raises InputError for a file that is given twice, or a recording without measurements.
    """
    seen = list[Path]()
    for path in [*train, *holdout]:
        if any(same_file(path, other) for other in seen):
            raise InputError(f"{path}: given twice, expected each recording once")
        seen.append(path)
    names = Counter(path.name for path in [*train, *holdout])
    lists = [[_read(path, names[path.name] > 1) for path in paths] for paths in (train, holdout)]
    return lists[0], lists[1]


def _read(path: Path, ambiguous: bool) -> Recording:
    """One recording with something measured in it."""
    recording = read_recording(path)
    if not recording.measured:
        raise InputError(f"{path}: no measured samples, expected a column such as x, y, ax or ay")
    return replace(recording, name=path.as_posix()) if ambiguous else recording


def chosen_machine(
    name: str | None, effects_file: Path | None, recordings: list[Recording]
) -> Machine:
    """The machine asked for, else the surrogate with the recordings' drive; fits them all."""
    machine = load_machine(
        assumed_machine(recordings) if name is None else name, own_effects(effects_file)
    )
    for recording in recordings:
        check_drive(recording, machine)
    return machine
