"""Building: archives, caches, machines inside, sources that compile."""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import pytest
from fmu_kit import FLAVOURS, FMU2Told, diseased, folder, machine, rectangle, template

from corexy_fmi.errors import InputError
from corexy_fmi.fmu.archive import read_archive
from corexy_fmi.fmu.build import binary_folders, build_fmu
from corexy_fmi.fmu.library import C_FILES, fmu_library, source_texts
from corexy_fmi.fmu.session import unpacked
from corexy_fmi.kernel.compiler import find_compiler
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import load_machine
from corexy_fmi.simulate import simulate

ROOT = Path(__file__).parents[1]
FRESH = """
import json, sys
import fmpy, numpy
fmu, signals, out = sys.argv[1:]
table = numpy.load(signals)
result = fmpy.simulate_fmu(fmu, input=table, output=["x", "y"], output_interval=1e-3,
                           stop_time=float(table["time"][-1]))
assert "corexy_fmi" not in sys.modules
numpy.save(out, result)
"""


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_the_same_machine_gives_the_same_bytes(flavour: str, tmp_path: Path) -> None:
    """Built twice."""
    again = build_fmu(tmp_path, None, flavour)
    assert again.read_bytes() == template(flavour).read_bytes()


def test_the_archive_holds_binary_sources_documents_and_the_machine() -> None:
    """The binary stands where fmpy looks."""
    names = set(zipfile.ZipFile(template()).namelist())
    library = f"CoreXY{fmpy.sharedLibraryExtension}"
    assert {f"binaries/{fmpy.platform}/{library}", "documentation/index.html", "sources/fmi2.c",
            "documentation/licenses/license.txt", "resources/machine.txt"} <= names  # fmt: skip
    with unpacked(template()) as place:
        page = (place / "documentation" / "index.html").read_text(encoding="utf-8")
        loaded = load_machine(place / "resources" / "machine.toml")
    assert all(word in page for word in ("effects.backlash.motor1.gap", "phi1_rate", "surrogate"))
    assert loaded == machine()


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_both_flavours_carry_icon_licence_and_page(flavour: str) -> None:
    """The icon is a PNG that is not blank."""
    import matplotlib.image

    content = read_archive(template(flavour))
    assert {"documentation/index.html", "documentation/licenses/license.txt"} <= set(content)
    icon = matplotlib.image.imread(io.BytesIO(content["model.png"]), format="png")
    assert icon.shape == (128, 128, 4)
    assert 0.1 < (icon[..., 3] > 0.5).mean() < 0.9


def test_nothing_of_a_machine_becomes_markup(tmp_path: Path) -> None:
    """Its name is text in the page and in the description."""
    fmu = build_fmu(tmp_path, replace(machine(), name="<b>&\n<script>"))
    with unpacked(fmu) as place:
        page = (place / "documentation" / "index.html").read_text(encoding="utf-8")
        assert "<script>" not in page
        assert "<script>" in fmpy.read_model_description(str(place)).description
        FMU2Told(place).open().freeInstance()


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_diagnosed_machine_travels_inside(flavour: str, tmp_path: Path) -> None:
    """A fresh process with fmpy alone, without start values, equals `simulate`."""
    import numpy as np

    from corexy_fmi.fmu.signals import fmpy_signals

    chosen = diseased()
    order = rectangle(chosen)
    np.save(tmp_path / "in.npy", fmpy_signals(order))
    arguments = [build_fmu(tmp_path, chosen, flavour), tmp_path / "in.npy", tmp_path / "out.npy"]
    subprocess.run(
        [sys.executable, "-c", FRESH, *map(str, arguments)], check=True, capture_output=True
    )
    result, expected = np.load(tmp_path / "out.npy"), simulate(chosen, order)
    for name in ("x", "y"):
        seen = np.interp(order.time, result["time"], result[name])
        assert np.abs(seen - expected[name]).max() < 1e-9
        assert np.abs(simulate(machine(), order)[name] - expected[name]).max() > 1e-6


DAMAGE = {
    "a number": (b"pulley.radius", b"pulley_radius", "checksum"),
    "a missing end": (b"checksum", b"checksun", "checksum"),
    "another FMU": (b"interface {", b"interface {0", "checksum"),
}


@pytest.mark.parametrize("kind", DAMAGE)
def test_a_damaged_machine_fails_the_instantiation(kind: str) -> None:
    """With a sentence, whatever was damaged."""
    old, new, word = DAMAGE[kind]
    with unpacked(template()) as place:
        path = place / "resources" / "machine.txt"
        path.write_bytes(path.read_bytes().replace(old, new))
        one = FMU2Told(place)
        with pytest.raises(Exception, match="instantiate"):
            one.open()
        assert word in one.messages[-1]
        assert "machine.txt" in one.messages[-1]


def test_a_machine_of_another_table_or_out_of_range_fails(tmp_path: Path) -> None:
    """Even where its checksum is right."""
    from corexy_fmi.fmu.machine_text import fnv1a

    with unpacked(template()) as place:
        path = place / "resources" / "machine.txt"
        body = path.read_bytes().rpartition(b"checksum")[0]
        bits = body.split(b"\n")[6].split()[1]
        changes = {
            b"interface": body.replace(b"interface {", b"interface {0"),
            b"pulley.radius": body.replace(bits, b"bff0000000000000", 1),
            b"expected it": body.replace(b"\n3 ", b"\n4 ", 1),
            b"corexy-machine 1": body.replace(b"machine 1", b"machine 2", 1),
            b"drive": body.replace(b"drive 1", b"drive 7", 1),
        }
        for word, text in changes.items():
            path.write_bytes(text + b"checksum %016x\n" % fnv1a(text))
            one = FMU2Told(place)
            with pytest.raises(Exception, match="instantiate"):
                one.open()
            assert word.decode() in one.messages[-1]


def test_a_missing_machine_or_a_wrong_guid_fails_the_instantiation() -> None:
    """With a sentence each."""
    with unpacked(template()) as place:
        one = FMU2Told(place)
        one.guid = "{0}"
        with pytest.raises(Exception, match="instantiate"):
            one.open()
        assert "fmuGUID" in one.messages[-1]
        (place / "resources" / "machine.txt").unlink()
        other = FMU2Told(place)
        with pytest.raises(Exception, match="instantiate"):
            other.open()
        assert "cannot be read" in other.messages[-1]


@pytest.mark.parametrize("name", ["with space", "ümläut", "50%41 + #1", "a+b", "日本"])
def test_any_path_of_the_unpacked_fmu_will_do(name: str, tmp_path: Path) -> None:
    """The resource URI is decoded whole."""
    place = tmp_path / name
    fmpy.extract(str(template()), str(place))
    one = FMU2Told(place).open()
    one.begin(phi1=2.0, phi2=0.0)
    assert one.read("x") == [0.005]
    one.freeInstance()


def test_a_value_out_of_range_is_refused_by_name(tmp_path: Path) -> None:
    """Such a machine would make an FMU that nobody can load."""
    numbers = {**machine().parameters, "carriage_mass": -1.0}
    with pytest.raises(InputError, match=r"carriage\.mass"):
        build_fmu(tmp_path, replace(machine(), parameters=numbers))
    with pytest.raises(InputError, match="flavour"):
        build_fmu(tmp_path, None, "cobol")
    assert list(tmp_path.iterdir()) == []


def test_two_builds_at_once_end_with_the_same_library(tmp_path: Path) -> None:
    """With an empty cache, in two processes."""
    code = "from pathlib import Path; from corexy_fmi.fmu.build import build_fmu; {}"
    env = {**os.environ, "COREXY_CACHE": str(tmp_path / "cache")}
    places = [tmp_path / name for name in ("one", "other")]
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", code.format(f"build_fmu(Path({str(p)!r}))")], env=env
        )
        for p in places
    ]
    assert [run.wait() for run in runs] == [0, 0]
    files = [(place / "CoreXY.fmu").read_bytes() for place in places]
    assert files[0] == files[1]
    assert len(list((tmp_path / "cache").iterdir())) == 1


def test_no_compiler_is_needed_once_the_library_is_cached(tmp_path: Path) -> None:
    """A machine is packed with an empty PATH."""
    library = fmu_library(bundled_layout())
    cache = tmp_path / "cache"
    cache.mkdir()
    shutil.copy2(library, cache)
    code = (
        "from pathlib import Path; from corexy_fmi.fmu.build import build_fmu;"
        "from corexy_fmi.machine import load_machine;"
        f"build_fmu(Path({str(tmp_path)!r}), load_machine('light_bench'))"
    )
    env = {**os.environ, "COREXY_CACHE": str(cache), "PATH": str(tmp_path), "CC": ""}
    subprocess.run([sys.executable, "-c", code], env=env, check=True)
    assert (tmp_path / "CoreXY.fmu").is_file()


def test_the_sources_are_clean_c99(tmp_path: Path) -> None:
    """Every file, generated ones too, without a warning."""
    for name, text in source_texts(bundled_layout()).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    flags = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-fsyntax-only"]
    command = [*find_compiler(), *flags, *C_FILES]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:2000]


def test_the_sources_inside_rebuild_the_binary(tmp_path: Path) -> None:
    """As `fmpy compile` does, after the binary is gone."""
    from fmpy.build import build_platform_binary

    tools = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    if shutil.which("cmake", path=tools) is None or shutil.which("make") is None:
        pytest.skip("no cmake or make here")
    place = tmp_path / "fmu"
    fmpy.extract(str(template()), str(place))
    shutil.rmtree(place / "binaries")
    before = os.environ["PATH"]
    try:
        os.environ["PATH"] = tools
        (tmp_path / "cmake").mkdir()
        build_platform_binary(place, tmp_path / "cmake")
    finally:
        os.environ["PATH"] = before
    one = FMU2Told(place).open()
    one.begin(phi1=2.0)
    one.doStep(0.0, 1e-3)
    one.freeInstance()


def test_a_binary_stands_where_fmpy_looks_on_aarch64_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """fmpy looks in linux64 there; FMI 2.0.5 has a name of its own. pythonfmu has no binary."""
    assert binary_folders() == (fmpy.platform,) or fmpy.architecture != "x86_64"
    monkeypatch.setattr(fmpy, "architecture", "aarch64")
    monkeypatch.setattr(fmpy, "platform", "linux64")
    monkeypatch.setattr(fmpy, "platform_tuple", "aarch64-linux")
    assert binary_folders() == ("linux64", "aarch64-linux")
    with pytest.raises(InputError, match="aarch64-linux, expected flavour native"):
        build_fmu(tmp_path, None, "python")


def test_the_script_at_the_root_builds(tmp_path: Path) -> None:
    """And says in one line what is wrong with its input."""
    script = [sys.executable, str(ROOT / "build_fmu.py"), "--out", str(tmp_path)]
    done = subprocess.run([*script, "--machine", "light_bench"], capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, str(tmp_path / "CoreXY.fmu"))
    wrong = subprocess.run([*script, "--machine", "nothing"], capture_output=True, text=True)
    assert wrong.returncode == 2
    assert wrong.stderr.count("\n") == 1
    assert folder().is_dir()
