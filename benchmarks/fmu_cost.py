"""What a communication step of 1 ms costs: set inputs, do the step, get outputs.

    python -m benchmarks.fmu_cost

times the native FMU, the pythonfmu flavour with its bundled kernel, a plain numpy slave of the same
equations and an FMU that does nothing, through fmpy and from a bare C host, and the kernel alone at
the same compiler flags; all in one run, in turns, the least of 41 rounds.  It needs gcc, and a
libpython for the Python flavours in the C host.  Writes benchmarks/results/fmu_cost.json and
docs/fmu.md.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from pythonfmu.builder import FmuBuilder

from corexy_fmi.fmu.archive import extract_archive
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.library import C_FILES, source_texts, write_sources
from corexy_fmi.kernel.compiler import FLAGS, cpu_name, find_compiler, native_sources, run_compiler
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import load_machine
from corexy_fmi.topology import STAGES

HERE = Path(__file__).parent
RESULT = HERE / "results" / "fmu_cost.json"
DOCUMENT = HERE.parent / "docs" / "fmu.md"
BEGIN, END = "<!-- fmu_cost: begin -->", "<!-- fmu_cost: end -->"
MACHINE, STEP, SPEED, HALF, ROUNDS = "yin2018", 1e-3, 8.0, 100, 41  # [s], [rad/s]; as in C
LIMIT = 3e-4  # [s] micro-step of that machine, held against the FMU's own below
VARIABLES = ("phi1", "phi2", "phi1_rate", "phi2_rate", "x", "y")
TURNS = 8  # more of the two that are close, and of the kernel
SAME = 1e-9  # [m] between all that computes
STEPS = {  # of a round in the C host and through fmpy, whole triangles
    "native": (10_000, 200),
    "empty": (10_000, 200),
    "python": (1_000, 400),
    "numpy": (400, 200),
}
NAMES = {
    "kernel": "the kernel alone",
    "empty": "an FMU that does nothing",
    "native": "native",
    "python": "pythonfmu, kernel bundled",
    "numpy": "pythonfmu, plain numpy",
}


@dataclass(frozen=True)
class Candidate:
    """An unpacked FMU."""

    name: str
    place: Path

    @property
    def description(self) -> Any:
        """As fmpy reads it."""
        return fmpy.read_model_description(str(self.place), validate=False)

    def references(self) -> list[int]:
        """Value references of what is set and got."""
        known = {v.name: v.valueReference for v in self.description.modelVariables}
        return [known[name] for name in VARIABLES]

    def library(self) -> Path:
        """Its binary."""
        identifier = self.description.coSimulation.modelIdentifier
        return (
            self.place / "binaries" / fmpy.platform / f"{identifier}{fmpy.sharedLibraryExtension}"
        )


def candidates(folder: Path) -> list[Candidate]:
    """All four, built and unpacked."""
    files = {
        "native": build_fmu(folder, load_machine(MACHINE)),
        "python": build_fmu(folder, load_machine(MACHINE), "python"),
        "numpy": numpy_fmu(folder),
    }
    found = []
    for name, file in files.items():
        extract_archive(file, folder / name)
        found.append(Candidate(name, folder / name))
    return [empty_fmu(folder, files["native"]), *found]


def empty_fmu(folder: Path, native: Path) -> Candidate:
    """The native FMU with a binary that does nothing."""
    made = Candidate("empty", folder / "empty")
    extract_archive(native, made.place)
    include = f"-I{native_sources() / 'fmi2'}"
    source, target = str(HERE / "empty_fmu.c"), str(made.library())
    flags = [flag for flag in FLAGS if "visibility" not in flag]
    run_compiler([*find_compiler(), *flags, include, "-shared", source, "-o", target])
    return made


def numpy_fmu(folder: Path) -> Path:
    """The numpy slave with its constants, by pythonfmu's own builder."""
    stage, parameters = STAGES["full"], load_machine(MACHINE).parameters
    constants = stage.constants(parameters, 0.0)
    np.savez(
        folder / "numpy_stage.npz",
        rows=stage.rows(parameters["pulley_radius"]),
        stiffness=np.array(constants.stiffness, float),
        mass=np.array(constants.mass, float),
        viscous=np.array(constants.viscous, float),
        coulomb=np.array(constants.coulomb, float),
        limit=LIMIT,
    )
    script = HERE / "numpy_slave.py"
    return Path(FmuBuilder.build_FMU(script, folder, [folder / "numpy_stage.npz"]))


def angle(n: int) -> tuple[float, float]:
    """A triangle: angle [rad] of motor 1 at a step, and its rate [rad/s]."""
    part = n % (2 * HALF)
    way = part if part < HALF else 2 * HALF - part
    return SPEED * STEP * way, SPEED if part < HALF else -SPEED


def through_fmpy(
    candidate: Candidate, steps: int, rounds: int = ROUNDS
) -> tuple[float, list[float]]:
    """Least time of a step [ns], and x, y [m] at the end."""
    description = candidate.description
    *inputs, x, y = candidate.references()
    slave = FMU2Slave(
        guid=description.guid,
        unzipDirectory=str(candidate.place),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="one",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    least, n, seen = float("inf"), 0, [0.0, 0.0]
    for _ in range(rounds):
        rows = [(k * STEP, [a, 0.0, r, 0.0]) for k in range(n, n + steps) for a, r in [angle(k)]]
        n += steps
        begun = time.perf_counter()
        for now, values in rows:
            slave.setReal(inputs, values)
            slave.doStep(now, STEP)
            seen = slave.getReal([x, y])
        least = min(least, (time.perf_counter() - begun) / steps)
    slave.terminate()
    slave.freeInstance()
    return 1e9 * least, [float(v) for v in seen]


def compiled_host(folder: Path) -> Path:
    """The C host with the kernel's sources inside, at the FMU's own flags."""
    (folder / "c").mkdir()
    write_sources(folder / "c", source_texts(bundled_layout()))
    kernel = [str(folder / "c" / name) for name in C_FILES if not name.startswith("fmi2")]
    host, flags = str(folder / "host"), [f for f in FLAGS if f not in ("-fPIC", "-std=c99")]
    words = ["-std=gnu99", *flags, "-DKERNEL", f"-I{folder / 'c'}", str(HERE / "fmu_cost_host.c")]
    run_compiler([*find_compiler(), *words, *kernel, "-o", host, "-ldl", "-lm"])
    return Path(host)


def python_environment() -> dict[str, str]:
    """What a host without Python needs for pythonfmu: libpython, its library, the packages."""
    folder, name = sysconfig.get_config_vars("LIBDIR", "INSTSONAME")
    library = Path(str(folder)) / str(name)
    packages = os.pathsep.join(p for p in sys.path if p.endswith("site-packages"))
    words = {"LD_PRELOAD": str(library), "PYTHONHOME": sys.base_prefix, "PYTHONPATH": packages}
    return {**os.environ, **words} if library.suffix != ".a" and library.exists() else {}


def in_c_host(
    host: Path, words: list[str], environment: Mapping[str, str] | None = None
) -> tuple[float, list[float]]:
    """Least time of a step [ns], and x, y [m] at the end.  Raises RuntimeError where it fails."""
    done = subprocess.run(
        [str(host), *words], capture_output=True, text=True, env=environment, timeout=250
    )
    if done.returncode:
        raise RuntimeError(f"{words[0]}: {done.returncode}: {done.stderr.strip()[-600:]}")
    least, x, y = map(float, done.stdout.split())
    return least, [x, y]


def host_words(candidate: Candidate) -> list[str]:
    """Arguments of the C host."""
    uri = (candidate.place / "resources").as_uri()
    first = [str(candidate.library()), candidate.description.guid, uri]
    return [*first, str(STEPS[candidate.name][0]), *map(str, candidate.references())]


def measure(folder: Path) -> dict[str, dict[str, float]]:
    """Nanoseconds of a step by candidate and host; all that computes must agree."""
    host, found, ends = compiled_host(folder), dict[str, dict[str, float]](), dict[str, Any]()
    listed = candidates(folder)
    resources = (folder / "native" / "resources").as_uri()
    for candidate in [*listed, *listed[:2] * TURNS]:  # the two that are close come often
        kernel, ends["kernel"] = in_c_host(host, ["kernel", resources, str(STEPS["native"][0])])
        keep(found, "kernel", "c", kernel)
        name, python = candidate.name, candidate.name in ("python", "numpy")
        least, ends[name, "fmpy"] = through_fmpy(candidate, STEPS[name][1])
        keep(found, name, "fmpy", least)
        environment = python_environment() if python else dict(os.environ)
        if environment:
            least, ends[name] = in_c_host(host, host_words(candidate), environment)
            keep(found, name, "c", least)
    check(ends)
    return found


def keep(found: dict[str, dict[str, float]], name: str, host: str, least: float) -> None:
    """The least of all turns [ns]: the processor is shared and changes its speed between them."""
    row = found.setdefault(name, {})
    row[host] = min(least, row.get(host, least))


def check(ends: dict[Any, list[float]]) -> None:
    """Every run ends where a whole triangle does, so all must be in one place [m]."""
    for name, end in ends.items():
        if "empty" not in (name, *name) and np.abs(np.subtract(end, ends["kernel"])).max() > SAME:
            raise RuntimeError(f"{name} ends at {end}, the kernel at {ends['kernel']}")


TARGETS = (
    ("native_over_kernel_c", "native over the kernel alone, C host", "at most 1.5"),
    ("numpy_over_native_c", "plain numpy over native, C host", "at least 100"),
    ("numpy_over_native_fmpy", "plain numpy over native, fmpy", ""),
    ("native_over_empty_fmpy", "native over an FMU that does nothing, fmpy", "at most 1.3"),
)


def table(document: dict[str, Any]) -> str:
    """The tables of docs/fmu.md as Markdown."""
    machine, load = document["machine"], document["load_before"][0]
    lines = [
        "Time of a step of 1 ms (set four inputs, do the step, get two outputs), machine "
        f"{MACHINE} (a surrogate), least of {ROUNDS} rounds in each turn; {machine['cpu']}, "
        f"{machine['cores']} cores, load {load:.1f}; "
        f"`{document['command']}` at commit {document['commit'][:12]}:",
        "",
        "| | bare C host [us] | fmpy, `FMU2Slave` [us] |",
        "|---|---|---|",
    ]
    for name, words in NAMES.items():
        found = document["ns"][name]
        cells = [f"{found[k] / 1e3:.3g}" if k in found else "" for k in ("c", "fmpy")]
        lines.append(f"| {words} | {cells[0]} | {cells[1]} |")
    lines += ["", "| ratio | found | target |", "|---|---|---|"]
    for key, words, target in TARGETS:
        if key in document["ratios"]:
            lines.append(f"| {words} | {document['ratios'][key]:.3g} | {target} |")
    return "\n".join(lines)


def render(document: dict[str, Any]) -> None:
    """Put the tables between their marks in docs/fmu.md."""
    before, rest = DOCUMENT.read_text(encoding="utf-8").split(BEGIN)
    page = f"{before}{BEGIN}\n{table(document)}\n{END}{rest.split(END)[1]}"
    DOCUMENT.write_text(page, encoding="utf-8")


def ratios(rows: dict[str, dict[str, float]]) -> dict[str, float]:
    """The three targets' figures."""
    found = {
        "native_over_kernel_c": rows["native"]["c"] / rows["kernel"]["c"],
        "native_over_empty_fmpy": rows["native"]["fmpy"] / rows["empty"]["fmpy"],
        "numpy_over_native_fmpy": rows["numpy"]["fmpy"] / rows["native"]["fmpy"],
    }
    if "c" in rows["numpy"]:
        found["numpy_over_native_c"] = rows["numpy"]["c"] / rows["native"]["c"]
    return found


def main() -> None:
    """Measure, print and write."""
    load = os.getloadavg()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        rows = measure(Path(folder))
    commit = subprocess.run(["git", "rev-parse", "HEAD"], capture_output=True, text=True).stdout
    model = cpu_name().split("model name")[-1].lstrip("\t :")
    document = {
        "command": "python -m benchmarks.fmu_cost",
        "commit": commit.strip(),
        "machine": {"cpu": model, "cores": os.cpu_count(), "python": platform.python_version()},
        "load_before": load,
        "load_after": os.getloadavg(),
        "ns": rows,
        "ratios": ratios(rows),
    }
    print(json.dumps(document, indent=1))
    render(document)
    RESULT.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
