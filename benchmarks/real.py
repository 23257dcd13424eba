"""A real recording for a fresh clone: EMPS, fetched from its authors, diagnosed (``make real``).

    python -m benchmarks.real [FOLDER]

fetches both recordings of EMPS through the loader of nonlinearbenchmark.org (nonlinear-benchmarks,
PyPI), checks them by hash, and runs the case of docs/cases/emps.md: pulses of force that were added
and logged by its authors must be found without their log.  FOLDER holds the recordings already;
nothing is fetched then.  Results go to out/real; the exit status is 1 where the case fails.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks import emps
from corexy_fmi.errors import InputError

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "out" / "real" / "emps"
HASHES = {
    "DATA_EMPS.mat": "6cf6814ae14618795da0101aae2bb97ff0c6351b0501b5492751b02b07facf7e",
    "DATA_EMPS_PULSES.mat": "0eab75bb1f6b16228ee78791343a88bf9bfd9a51036ac9807d7b5fc11c0e1704",
}
HINT = "python -m benchmarks.real FOLDER, where FOLDER holds DATA_EMPS.mat and DATA_EMPS_PULSES.mat"


def check(folder: Path) -> Path:
    """The folder, if it holds the recordings that the case was made with; else InputError."""
    for name, expected in HASHES.items():
        path = folder / name
        if not path.is_file():
            raise InputError(f"{path}: no such file, expected a recording of EMPS")
        found = hashlib.sha256(path.read_bytes()).hexdigest()
        if found != expected:
            raise InputError(f"{path}: sha256 {found[:12]}.., expected {expected[:12]}..")
    return folder


def fetch(kept: Path) -> Path:
    """The recordings in ``kept``, fetched unless they are there; whole and checked, or not at all.

    Raises InputError where the loader is missing, nothing can be fetched, or a file is another one.
    """
    if kept.is_dir():
        return check(kept)
    try:
        from nonlinear_benchmarks import EMPS
    except ImportError as error:
        raise InputError(
            "nonlinear-benchmarks is missing, expected it: "
            ".venv/bin/python -m pip install nonlinear-benchmarks==1.0.1"
        ) from error
    kept.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=kept.parent) as name:
        try:
            paths = [Path(p) for p in EMPS(data_file_locations=True, dir_placement=name)]
        except Exception as error:  # the loader raises whatever its libraries do
            why = f"{type(error).__name__}: {error}".splitlines()[0][:160]
            raise InputError(
                f"EMPS cannot be fetched ({why}), expected access to drive.google.com; or {HINT}"
            ) from error
        folder = check(paths[0].parent)
        kept.mkdir()
        for file in HASHES:
            shutil.move(folder / file, kept / file)
    return kept


def told(result: dict[str, Any]) -> tuple[list[str], bool]:
    """Lines for the screen, and whether the case came out as it must."""
    found, runs = result["pulses"], result["runs"]
    untouched = [e["name"] for e in runs["DATA_EMPS"]["effects"]]
    lines = [f"DATA_EMPS         {runs['DATA_EMPS']['verdict']}: {', '.join(untouched)}"]
    if not found:
        return [*lines, "DATA_EMPS_PULSES  no pulses named"], False
    lines += [
        f"DATA_EMPS_PULSES  {runs['DATA_EMPS_PULSES']['verdict']}: pulses on {found['place']}",
        f"windows  logged {found['windows_logged']}, found {found['windows_found']}, "
        f"edges within {1e3 * found['edge_error_max']:.1f} ms (20 allowed)",
        f"size     logged {found['size_logged']:.1f} N, found {found['size_found']:.1f} N "
        f"({100 * found['size_error']:.1f} %, 10 allowed)",
    ]
    right = (
        found["windows_logged"] == found["windows_found"]
        and found["edge_error_max"] < 0.02
        and found["size_error"] < 0.1
        and "periodic_disturbance" not in untouched
    )
    return lines, right


def main() -> None:
    """Fetch, diagnose, judge."""
    try:
        folder = check(Path(sys.argv[1])) if len(sys.argv) > 1 else fetch(KEPT)
    except InputError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
    print("EMPS: two diagnoses, some minutes")
    out = KEPT.parent
    out.mkdir(parents=True, exist_ok=True)
    result = emps.measure(folder, out)
    (out / "emps.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    lines, right = told(result)
    print("\n".join([*lines, f"the found force over the logged one: {out / 'emps_pulses.png'}"]))
    sys.exit(0 if right else 1)


if __name__ == "__main__":
    main()
