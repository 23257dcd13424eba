"""The binaries of other platforms run here, as far as emulators are installed.

    python -m benchmarks.platforms

builds the FMU for all platforms, drives one rectangle through each binary from a C host that loads
it as an importer does, and compares with the x86-64 one; writes benchmarks/results/platforms.json.
It needs the wheel ziglang; `qemu-user-static libc6-arm64-cross` for aarch64, `wine` for Windows.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from numpy.typing import NDArray

from benchmarks.fmu_inputs import angles
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.platforms import SMALL, zig_compiler
from corexy_fmi.kernel.compiler import native_sources, run_compiler
from corexy_fmi.machine import load_machine
from corexy_fmi.rectangle import Rectangle

HOST = Path(__file__).with_name("foreign_host.c")
DOCUMENT = Path(__file__).parents[1] / "docs" / "fmu.md"
BEGIN, END = "<!-- platforms: begin -->", "<!-- platforms: end -->"
RESULT = Path(__file__).parent / "results" / "platforms.json"
OUTPUTS, INPUTS = ("x_true", "y_true", "x", "y"), ("phi1", "phi2", "phi1_rate", "phi2_rate")
SIDES, SPEED, STEP = (0.056, 0.042), 0.1, 1e-3  # [m], [m/s], [s]
ODD = "r\u00e9sources + #1"  # a folder that a URI has to escape
INSTALL = "apt-get install qemu-user-static libc6-arm64-cross wine"
ARM = ("qemu-aarch64-static", "-L", "/usr/aarch64-linux-gnu")


@dataclass(frozen=True)
class Runner:
    """A binary's folder and file, zig's name of its platform, what runs it, the root of paths."""

    binary: str
    target: str
    command: tuple[str, ...] = ()
    root: str = ""

    def lacks(self) -> str | None:
        """What is needed to run it and absent here."""
        needed = (*self.command[:1], *self.command[2:])
        absent = [n for n in needed if shutil.which(n) is None and not Path(n).is_dir()]
        return absent[0] if absent else None


RUNNERS = (
    Runner("linux64/CoreXY.so", "x86_64-linux-gnu"),
    Runner("aarch64-linux/CoreXY.so", "aarch64-linux-gnu", ARM),
    Runner("win64/CoreXY.dll", "x86_64-windows-gnu", ("wine",), "/Z:"),
)


def rectangle_text(machine: str) -> str:
    """The host's input: step [s], then angles [rad] and rates [rad/s] at each point."""
    motion = Rectangle(*SIDES, SPEED).motion
    time = STEP * np.arange(int(motion.duration / STEP + 1e-9) + 1)
    phi = angles(motion, load_machine(machine), time)
    rates = np.vstack([np.diff(phi, axis=0) / STEP, np.zeros((1, 2))])
    rows = np.column_stack([phi, rates]).tolist()
    return "\n".join([repr(STEP), *(" ".join(map(repr, row)) for row in rows)]) + "\n"


def compile_host(runner: Runner, place: Path) -> Path:
    """The host for a runner's platform, which knows the references of its variables."""
    known = {
        v.name: v.valueReference for v in fmpy.read_model_description(str(place)).modelVariables
    }
    lists = (("OUTPUTS", OUTPUTS), ("INPUTS", INPUTS))
    macros = [f"-D{key}={','.join(str(known[n]) for n in names)}" for key, names in lists]
    host = place / f"host-{runner.target}.exe"
    include = f"-I{native_sources() / 'fmi2'}"
    like_the_library = ["-std=c99", "-O3", *SMALL]  # else zig compiles another C runtime, a minute
    flags = ["-target", runner.target, *like_the_library, include, *macros]
    run_compiler([*zig_compiler(), *flags, str(HOST), "-o", str(host)], place)
    return host


def run(runner: Runner, place: Path, text: str) -> NDArray[np.float64]:
    """x_true, y_true, x, y [m] (points, 4) at the communication points.

    Raises RuntimeError with the host's words where it fails.
    """
    host = compile_host(runner, place)
    uri = (place / ODD).as_uri().replace("file://", f"file://{runner.root}")
    library = f"{runner.root.lstrip('/')}{place / 'binaries' / runner.binary}"
    guid = fmpy.read_model_description(str(place)).guid
    environment = {**os.environ, "WINEPREFIX": str(place / "wine"), "WINEDEBUG": "-all"}
    command = [*runner.command, str(host), library, guid, uri]
    done = subprocess.run(command, input=text, capture_output=True, text=True, env=environment)
    if done.returncode:
        raise RuntimeError(f"{runner.binary}: {done.returncode}: {done.stderr.strip()[-800:]}")
    return np.array([line.split() for line in done.stdout.splitlines()], float)


def compare(place: Path, machine: str) -> list[dict[str, Any]]:
    """A row for each binary that could run: how far it is from the first one [m]."""
    text, rows, first = rectangle_text(machine), [], None
    for runner in RUNNERS:
        if runner.lacks():
            print(f"{runner.binary}: not run, {runner.lacks()} is not installed ({INSTALL})")
            continue
        path = run(runner, place, text)
        first = path if first is None else first
        rows.append(
            {
                "binary": runner.binary,
                "by": " ".join(runner.command[:1]) or "directly",
                "points": len(path),
                "stroke_m": float(np.ptp(path[:, 0])),
                "difference_m": float(np.abs(path - first).max()),
            }
        )
    return rows


def table(document: dict[str, Any]) -> str:
    """The table of docs/fmu.md as Markdown."""
    lines = [
        f"Rectangle of {1e3 * SIDES[0]:g} mm x {1e3 * SIDES[1]:g} mm at {1e3 * SPEED:g} mm/s, step "
        f"{1e3 * STEP:g} ms, machine yin2018 (a surrogate), from a C host with its resources in a "
        "folder whose name has an accent and a blank; largest difference of x, y, x_true, y_true "
        f"from the first row; `{document['command']}` at commit {document['commit'][:12]}:",
        "",
        "| binary | run by | points | difference [m] |",
        "|---|---|---|---|",
    ]
    for row in document["rows"]:
        cells = (f"`{row['binary']}`", row["by"], str(row["points"]), f"{row['difference_m']:g}")
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def render(document: dict[str, Any]) -> None:
    """Put the table between its marks in docs/fmu.md."""
    before, rest = DOCUMENT.read_text(encoding="utf-8").split(BEGIN)
    page = f"{before}{BEGIN}\n{table(document)}\n{END}{rest.split(END)[1]}"
    DOCUMENT.write_text(page, encoding="utf-8")


def main() -> None:
    """Build, run, print and write."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        place = Path(name) / "fmu"
        fmpy.extract(str(build_fmu(Path(name), all_platforms=True)), str(place))
        shutil.copytree(place / "resources", place / ODD)
        rows = compare(place, "yin2018")
    commit = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True).stdout
    document = {"command": "python -m benchmarks.platforms", "commit": commit.strip(), "rows": rows}
    render(document)
    RESULT.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(document, indent=1))


if __name__ == "__main__":
    main()
