"""The native library from bare C: memory by valgrind, threads by the sanitizer, calls of a step."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest
from binary_symbols import imports
from fmu_kit import diseased, folder, template

from corexy_fmi.fmu.archive import read_archive
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.library import C_FILES, source_texts, write_sources
from corexy_fmi.fmu.session import unpacked
from corexy_fmi.kernel.compiler import find_compiler, native_sources
from corexy_fmi.kernel.layout import bundled_layout

HERE = Path(__file__).parent
NAMES = {
    "PHI1": "phi1", "PHI2": "phi2", "X": "x", "VX": "vx", "MASS": "carriage.mass", "DRIVE": "drive",
    "INTERPOLATION": "inputInterpolation",
}  # fmt: skip
COUNTED = {"malloc", "calloc", "realloc", "free", "snprintf", "sprintf", "fopen", "fread", "fclose"}
PURE = {"memcmp", "memcpy", "memmove", "memset", "strchr", "strcmp", "strcpy", "strlen", "strncmp",
        "fmin", "fmax"}  # fmt: skip
LOADER = {"__cxa_finalize"}
VALGRIND = ("valgrind", "--quiet", "--error-exitcode=99", "--leak-check=full",
            "--errors-for-leak-kinds=definite,indirect,possible")  # fmt: skip

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="the C drivers are for Linux"
)


def compiled(name: str, place: Path, target: Path, *flags: str) -> Path:
    """A driver beside this file, which knows the references of an unpacked FMU."""
    variables = fmpy.read_model_description(str(place)).modelVariables
    references = {v.name: v.valueReference for v in variables}
    macros = [f"-D{macro}={references[variable]}" for macro, variable in NAMES.items()]
    include = f"-I{native_sources() / 'fmi2'}"
    words = ["-std=gnu99", "-Wno-unused", *flags, include, *macros, str(HERE / name)]
    run([*find_compiler(), *words, "-o", str(target), "-ldl", "-lm", "-lpthread"])
    return target


def run(command: list[str]) -> str:
    """What a command prints; it must end well."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, f"{done.returncode}: {done.stderr[-3000:]}"
    return done.stdout


def arguments(place: Path, library: Path | None = None) -> list[str]:
    """Library, GUID and the URI of the resources."""
    binary = library or place / "binaries" / fmpy.platform / "CoreXY.so"
    guid = fmpy.read_model_description(str(place)).guid
    return [str(binary), guid, (place / "resources").as_uri()]


@pytest.mark.parametrize("inside", [False, True])
def test_the_driver_finds_the_statuses_of_the_standard(inside: bool, tmp_path: Path) -> None:
    """Each call of a whole life, and what must be refused: with a sentence each."""
    fmu = build_fmu(folder() / "diseased", diseased()) if inside else template()
    with unpacked(fmu) as place:
        driver = compiled("fmu_walk.c", place, tmp_path / "walk")
        told = run([str(driver), *arguments(place)]).split()
    assert int(told[0]) > 50


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
@pytest.mark.parametrize("inside", [False, True])
def test_valgrind_finds_nothing(inside: bool, tmp_path: Path) -> None:
    """Instantiate, step, free and every error path: nothing invalid, nothing lost."""
    fmu = build_fmu(folder() / "diseased", diseased()) if inside else template()
    with unpacked(fmu) as place:
        driver = compiled("fmu_walk.c", place, tmp_path / "walk", "-g")
        run([*VALGRIND, str(driver), *arguments(place)])


@pytest.mark.skipif(shutil.which("valgrind") is None, reason="valgrind is not installed")
def test_valgrind_would_find_an_instance_that_is_not_freed(tmp_path: Path) -> None:
    """The same command, with the last thing forgotten."""
    with unpacked(template()) as place:
        driver = compiled("fmu_walk.c", place, tmp_path / "walk", "-DFORGET")
        done = subprocess.run([*VALGRIND, str(driver), *arguments(place)], capture_output=True)
    assert done.returncode == 99


def sanitised(command: list[str]) -> subprocess.CompletedProcess[str]:
    """A run under the sanitizer; where memory is scattered too widely for it, without that."""
    options = {**os.environ, "TSAN_OPTIONS": "exitcode=66"}
    for prefix in ([], ["setarch", "-R"]):
        if prefix and shutil.which(prefix[0]) is None:
            break
        done = subprocess.run([*prefix, *command], capture_output=True, text=True, env=options)
        if "unexpected memory mapping" not in done.stderr and "setarch" not in done.stderr:
            return done
    pytest.skip("the thread sanitizer cannot run here: unexpected memory mapping")


def test_threads_do_not_race(tmp_path: Path) -> None:
    """Instances in four threads, compiled with the thread sanitizer; each gives the same bits."""
    write_sources(tmp_path, source_texts(bundled_layout()))
    sanitized = ("-fsanitize=thread", "-g", "-O1")
    library = tmp_path / "CoreXY.so"
    sources = [str(tmp_path / name) for name in C_FILES]
    flags = [*sanitized, "-std=c99", "-fPIC", "-shared", "-o", str(library)]
    done = subprocess.run(
        [*find_compiler(), *sources, *flags, "-lm"], capture_output=True, text=True
    )
    if done.returncode and "tsan" in done.stderr:
        pytest.skip("the compiler here has no thread sanitizer")
    assert done.returncode == 0, done.stderr[-2000:]
    with unpacked(template()) as place:
        racing, clean = (
            compiled("fmu_threads.c", place, tmp_path / name, *sanitized, *more)
            for name, more in (("racing", ["-DRACE"]), ("clean", []))
        )
        words = arguments(place, library)
        done, raced = (sanitised([str(driver), *words]) for driver in (clean, racing))
    assert done.returncode == 0, done.stderr[-3000:]
    assert float(done.stdout) != 0.0
    assert (raced.returncode, "data race" in raced.stderr) == (66, True)


def test_a_step_neither_allocates_nor_locks_nor_writes(tmp_path: Path) -> None:
    """Nothing of the C library that could is called; what else is imported cannot."""
    content = read_archive(template())
    names = imports(content[f"binaries/{fmpy.platform}/CoreXY.so"])
    assert names <= COUNTED | PURE | LOADER
    assert {"malloc", "free", "snprintf"} <= names
    with unpacked(template()) as place:
        driver = compiled("fmu_quiet.c", place, tmp_path / "quiet", "-rdynamic")
        made, steps, refusal = map(int, run([str(driver), *arguments(place)]).split())
    assert made > 5
    assert refusal > 0
    assert steps == 0
