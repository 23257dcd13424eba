"""One file for all platforms: layout, symbols, bytes; what is run here is the host's binary.

`python -m benchmarks.platforms` runs the others under emulators.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import struct
import subprocess
import sys
from functools import cache
from pathlib import Path

import fmpy
import numpy as np
import pytest
from binary_symbols import parts, signed_pages
from fmu_kit import folder, machine, rectangle, template

from benchmarks import platforms as emulated
from corexy_fmi.errors import InputError
from corexy_fmi.fmu.archive import read_archive
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.library import source_texts, write_sources
from corexy_fmi.fmu.platforms import FOLDERS, PLATFORMS, platform_library, zig_compiler
from corexy_fmi.fmu.runner import run_fmu
from corexy_fmi.fmu.universal import universal_binary
from corexy_fmi.kernel.compiler import native_sources, portable_flags, run_compiler
from corexy_fmi.kernel.layout import bundled_layout

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[1]
NEEDS_ZIG = pytest.mark.skipif(
    importlib.util.find_spec("ziglang") is None,
    reason="no other platform is built: the wheel ziglang is absent (pip install ziglang, 100 MB)",
)
LARGEST = 400_000  # [bytes] of a binary for one processor


@cache
def everywhere() -> Path:
    """The FMU for all platforms, built once."""
    return build_fmu(folder() / "everywhere", all_platforms=True)


def standard_names() -> set[str]:
    """The functions of FMI 2.0 for co-simulation, from the standard's own header."""
    header = (native_sources() / "fmi2" / "fmi2Functions.h").read_text(encoding="utf-8")
    common, rest = (
        header.rsplit("for Model Exchange", 1)[0],
        header.rsplit("for Co-Simulation", 1)[1],
    )
    return {f"fmi2{name}" for name in re.findall(r"FMI2_Export fmi2(\w+)TYPE", common + rest)}


@NEEDS_ZIG
def test_every_platform_has_its_binary_where_importers_look() -> None:
    """x86-64 under the names of FMI 1, the others beside, macOS as a universal file too."""
    content = read_archive(everywhere())
    found = {n: set(parts(d)) for n, d in content.items() if n.startswith("binaries/")}
    assert found == {
        "binaries/linux64/CoreXY.so": {"linux x86_64"},
        "binaries/aarch64-linux/CoreXY.so": {"linux aarch64"},
        "binaries/win64/CoreXY.dll": {"windows x86_64"},
        "binaries/darwin64/CoreXY.dylib": {"darwin x86_64", "darwin aarch64"},
        "binaries/aarch64-darwin/CoreXY.dylib": {"darwin aarch64"},
    }
    assert all(len(content[name]) < LARGEST * len(kinds) for name, kinds in found.items())
    assert {"linux64", "win64", "darwin64"} <= set(fmpy.supported_platforms(str(everywhere())))


@NEEDS_ZIG
def test_all_but_the_binaries_is_as_in_the_hosts_fmu() -> None:
    """Sources, machine, description, documentation."""
    many, one = read_archive(everywhere()), read_archive(template())
    assert {n: d for n, d in many.items() if not n.startswith("binaries/")} == {
        n: d for n, d in one.items() if not n.startswith("binaries/")
    }


def test_the_hosts_binary_exports_the_standards_functions_only() -> None:
    """As compiled by the compiler that is here."""
    names = read_archive(template())
    for data in (d for n, d in names.items() if n.startswith("binaries/")):
        assert list(parts(data).values()) == [standard_names()]


@NEEDS_ZIG
def test_all_binaries_export_the_standards_functions_only() -> None:
    """Read from the dynamic symbols of ELF, PE and Mach-O."""
    for name, data in read_archive(everywhere()).items():
        if name.startswith("binaries/"):
            assert all(found == standard_names() for found in parts(data).values()), name


@NEEDS_ZIG
def test_the_arm64_macos_binary_is_signed_ad_hoc() -> None:
    """macOS on arm64 kills a process that loads a page without its hash."""
    data = read_archive(everywhere())["binaries/aarch64-darwin/CoreXY.dylib"]
    pages = signed_pages(data)
    assert len(pages) > 2
    assert all(pages)
    damaged = bytearray(data)
    damaged[len(data) // 2] ^= 1
    assert signed_pages(bytes(damaged)).count(False) == 1


@NEEDS_ZIG
def test_the_same_sources_give_the_same_bytes_without_a_cache(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiled in another folder; one target of each format."""
    texts = source_texts(bundled_layout())
    formats = ("aarch64-linux", "aarch64-darwin", "x86_64-windows")
    before = {name: platform_library(name, texts) for name in formats}
    monkeypatch.setenv("COREXY_CACHE", str(tmp_path))
    assert {name: platform_library(name, texts) for name in formats} == before
    assert len(list(tmp_path.iterdir())) == len(formats)
    assert not any(str(folder()).encode() in data for data in before.values())


@NEEDS_ZIG
def test_it_moves_as_the_fmu_of_this_host_to_the_last_bit() -> None:
    """Two compilers, one trajectory."""
    if fmpy.platform_tuple != "x86_64-linux":
        pytest.skip("fmpy loads the x86-64 binary on x86-64 only")
    order = rectangle(machine())
    one, other = (run_fmu(fmu, order, machine()) for fmu in (everywhere(), template()))
    for name in ("x", "y"):
        assert np.ptp(one[name]) > 1e-3
        assert np.array_equal(one[name], other[name])


def test_without_zig_one_line_says_what_to_install(tmp_path: Path) -> None:
    """From the script and from the command; nothing is written."""
    code = (
        "import sys; sys.modules['ziglang'] = None; sys.argv[0] = sys.argv.pop(1);"
        "import runpy; runpy.run_path(sys.argv[0], run_name='__main__')"
    )
    for script in ("build_fmu.py", "src/corexy_fmi/__main__.py"):
        words = ["build"] if script.endswith("__main__.py") else []
        place = [*words, "--all-platforms", "--out", str(tmp_path)]
        command = [sys.executable, "-c", code, str(ROOT / script), *place]
        env = {**os.environ, "COREXY_CACHE": str(tmp_path / "cache")}
        done = subprocess.run(command, capture_output=True, text=True, env=env)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
        assert "pip install ziglang" in done.stderr
    assert not (tmp_path / "CoreXY.fmu").exists()


def test_the_python_flavour_has_no_other_platforms(tmp_path: Path) -> None:
    """Refused before anything is built."""
    with pytest.raises(InputError, match="expected native for all platforms"):
        build_fmu(tmp_path, None, "python", all_platforms=True)


def test_a_universal_file_holds_its_parts_unchanged() -> None:
    """At whole pages, in their order; other files and two of one kind are refused."""
    files = [struct.pack("<III", 0xFEEDFACF, cpu, 0) + bytes(n) for cpu, n in ((7, 1), (12, 70000))]
    data = universal_binary(files)
    assert struct.unpack_from(">II", data) == (0xCAFEBABE, 2)
    for i, file in enumerate(files):
        cpu, _, start, size, power = struct.unpack_from(">IIIII", data, 8 + 20 * i)
        assert cpu == (7, 12)[i]
        assert start % (1 << power) == 0
        assert data[start : start + size] == file
    with pytest.raises(ValueError, match="different"):
        universal_binary([files[0], files[0]])
    with pytest.raises(ValueError, match="magic"):
        universal_binary([b"\x7fELF" + bytes(60)])


@pytest.mark.parametrize(
    ("name", "folders"),
    [
        ("x86_64", ("linux64",)),
        ("aarch64", ("linux64", "aarch64-linux")),
        ("arm64", ("linux64", "aarch64-linux")),
    ],
)
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="folders of Linux")
def test_a_hosts_build_stands_where_its_own_fmpy_looks(name: str, folders: tuple[str, ...]) -> None:
    """By the host's machine name; fmpy itself decides, in a process of its own."""
    code = (
        f"import platform; platform.machine = lambda: {name!r}; import fmpy;"
        "from corexy_fmi.fmu.build import binary_folders as found;"
        "assert fmpy.platform in found(); print(*found())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert tuple(done.stdout.split()) == folders


def test_zig_is_kept_from_what_only_this_processor_has() -> None:
    """Its default is the processor that it runs on."""
    assert portable_flags((sys.executable, "-m", "ziglang", "cc")) == ("-mcpu=baseline",)
    assert portable_flags(("gcc",)) == ()
    assert set().union(*map(set, FOLDERS.values())) == set(PLATFORMS)


@NEEDS_ZIG
def test_windows_code_is_clean_c99_too(tmp_path: Path) -> None:
    """The one file that tells platforms apart."""
    write_sources(tmp_path, source_texts(bundled_layout()))
    flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-c", "machine_file.c"]
    run_compiler([*zig_compiler(), "-target", "x86_64-windows-gnu", *flags], tmp_path)


@cache
def path_of(runner: emulated.Runner) -> np.ndarray:
    """x_true, y_true, x, y [m] of the rectangle by a binary, its resources in an odd folder."""
    place = folder() / f"run-{runner.target}"
    fmpy.extract(str(everywhere()), str(place))
    (place / "resources").rename(place / emulated.ODD)
    return emulated.run(runner, place, emulated.rectangle_text("yin2018"))


@NEEDS_ZIG
@pytest.mark.parametrize("runner", emulated.RUNNERS[1:], ids=lambda runner: runner.binary)
def test_a_foreign_binary_moves_as_the_one_of_this_host(runner: emulated.Runner) -> None:
    """From a C host under qemu-user and wine, which loads it as an importer does."""
    if runner.lacks():
        pytest.skip(f"{runner.lacks()} is not installed ({emulated.INSTALL})")
    found, expected = path_of(runner), path_of(emulated.RUNNERS[0])
    assert np.ptp(found[:, 0]) == pytest.approx(emulated.SIDES[0], rel=0.01)
    assert np.abs(found - expected).max() < 1e-12


def test_the_page_tells_what_was_measured_under_emulators() -> None:
    """All three binaries ran the whole rectangle, and moved alike."""
    document = json.loads(emulated.RESULT.read_text(encoding="utf-8"))
    assert emulated.table(document) in emulated.DOCUMENT.read_text(encoding="utf-8")
    assert [row["binary"] for row in document["rows"]] == [r.binary for r in emulated.RUNNERS]
    for row in document["rows"]:
        assert row["stroke_m"] == pytest.approx(emulated.SIDES[0], rel=0.01)
        assert row["difference_m"] <= 1e-12
