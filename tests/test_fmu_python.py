"""The pythonfmu flavour: safe in its host, complete in its state, unique in its names."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest
from fmu_kit import FMU2Told, diseased, folder, machine, rectangle, slave, template

from corexy_fmi.errors import InputError
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.runner import run_fmu
from corexy_fmi.fmu.session import unpacked
from corexy_fmi.kernel.compiler import find_compiler


def script(fmu: Path) -> str:
    """Name of the slave's module."""
    return zipfile.ZipFile(fmu).read("resources/slavemodule.txt").decode()


def test_module_names_are_unique_to_the_build() -> None:
    """Two FMUs of other machines in one process must not share a module."""
    other = build_fmu(folder() / "diseased", diseased(), "python")
    assert script(template("python")) != script(other)
    order = rectangle(machine())
    first = run_fmu(template("python"), order)
    run_fmu(other, order)
    assert all((run_fmu(template("python"), order)[n] == first[n]).all() for n in ("x", "y"))


def test_its_archive_is_pythonfmus_without_other_platforms() -> None:
    """The capability flags are true to it."""
    names = zipfile.ZipFile(template("python")).namelist()
    binaries = [name for name in names if name.startswith("binaries/")]
    assert binaries == [f"binaries/{fmpy.platform}/CoreXYPython{fmpy.sharedLibraryExtension}"]
    simulation = fmpy.read_model_description(str(template("python"))).coSimulation
    assert simulation.needsExecutionTool
    assert not simulation.canInterpolateInputs
    assert not simulation.providesDirectionalDerivative
    assert simulation.maxOutputDerivativeOrder == 0


def test_its_state_is_complete() -> None:
    """Saved, restored and serialised runs continue bit for bit."""
    with slave(template("python")) as one:
        one.begin()
        one.put(phi1_rate=9.0, phi2_rate=-4.0)
        one.doStep(0.0, 0.02)
        saved = one.getFMUstate()
        data = one.serializeFMUstate(saved)
        runs = []
        for state in (None, saved, one.deSerializeFMUstate(data)):
            if state is not None:
                one.setFMUstate(state)
            one.doStep(0.02, 0.03)
            runs.append(one.read("x", "y", "vx", "tension1", "time"))
        assert runs[0] == runs[1] == runs[2]


def test_reset_and_two_instances() -> None:
    """A reset gives the first run again; instances do not touch each other."""
    with unpacked(template("python")) as place:
        one, other = (FMU2Told(place, n).open() for n in ("one", "other"))
        one.begin(phi1=1.0)
        other.begin(phi1=3.0)
        one.doStep(0.0, 0.01)
        assert (one.read("phi1_meas"), other.read("phi1_meas")) == ([1.0], [3.0])
        one.reset()
        one.begin(phi1=2.0)
        assert one.read("phi1_meas") == [2.0]
        other.fmi2FreeInstance(other.component)
        one.freeInstance()


def test_no_exception_leaves_it(capfd: pytest.CaptureFixture[str]) -> None:
    """Wrong values and references are told on stderr; the next step says no; the host lives."""
    with slave(template("python")) as one:
        one.begin()
        for _ in range(10):
            assert one.status("setReal", [one.references["phi1"]], [float("nan")]) == 0
            assert one.status("getReal", [99999]) == 0
            assert one.status("getInteger", [99999]) == 0
            assert one.status("doStep", 0.0, 1e-3) == 2
        one.reset()
        one.begin()
        assert one.status("doStep", 0.0, -1.0) == 2
    told = capfd.readouterr().err
    assert "phi1" in told
    assert "communicationStepSize" in told


def test_its_sentences_reach_the_masters_log() -> None:
    """Where logging is on."""
    with unpacked(template("python")) as place:
        one = FMU2Told(place).open(logging=True)
        one.begin()
        assert any("machine yin2018" in message for message in one.messages)
        one.status("setReal", [one.references["carriage.mass"]], [1.0])
        assert "fixed" in one.messages[-1]
        one.freeInstance()


def test_a_damaged_machine_fails_its_instantiation(capfd: pytest.CaptureFixture[str]) -> None:
    """With the library's sentence on stderr."""
    with unpacked(template("python")) as place:
        path = place / "resources" / "machine.txt"
        path.write_bytes(path.read_bytes().replace(b"pulley.radius", b"pulley.tadius"))
        with pytest.raises(Exception, match="instantiate"):
            FMU2Told(place).open()
    assert "checksum is wrong" in capfd.readouterr().err


def test_a_missing_library_is_told(capfd: pytest.CaptureFixture[str]) -> None:
    """On stderr too, where the master mutes its log."""
    with unpacked(template("python")) as place:
        for file in (place / "resources").glob("*.library.*"):
            file.unlink()
        with pytest.raises(Exception, match="instantiate"):
            FMU2Told(place).open()
    assert "expected the kernel" in capfd.readouterr().err


def test_a_path_that_pythonfmu_cannot_load_is_refused(tmp_path: Path) -> None:
    """It would crash the host; a space is fine."""
    code = (
        "import sys; from pathlib import Path\n"
        "from corexy_fmi.fmu.session import Session, unpacked\n"
        "with unpacked(Path(sys.argv[1])) as place, Session(Path(sys.argv[1]), place): pass"
    )
    for name, status in (("a b", 0), ("ä", 1)):
        place = tmp_path / name
        place.mkdir()
        done = subprocess.run(
            [sys.executable, "-c", code, str(template("python"))],
            env={"TMPDIR": str(place)}, capture_output=True, text=True,
        )  # fmt: skip
        assert done.returncode == status, done.stderr
        assert (InputError.__name__ in done.stderr) == bool(status)


FREED = """
import sys; from pathlib import Path; from fmu_kit import FMU2Told
for n in range(6):
    one = FMU2Told(Path(sys.argv[1])).open(logging=bool(n % 2))
    if n % 3:
        one.begin(); one.doStep(0.0, 1e-3); one.reset()
    one.fmi2FreeInstance(one.component)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="LD_PRELOAD")
def test_an_instance_may_be_freed_at_any_time(tmp_path: Path) -> None:
    """Straight after it was made or reset, where pythonfmu crashes if messages are waiting; and
    what it still touches when the process ends must be there: freed objects are out of reach."""
    guard = tmp_path / "guarded_new.so"
    source = Path(__file__).with_name("guarded_new.c")
    subprocess.run(
        [*find_compiler(), "-shared", "-fPIC", "-o", str(guard), str(source)], check=True
    )
    with unpacked(template("python")) as place:
        done = subprocess.run(
            [sys.executable, "-c", FREED, str(place)], cwd=Path(__file__).parent,
            capture_output=True, text=True, env={**os.environ, "LD_PRELOAD": str(guard)},
        )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_damaged_bytes_of_a_state_do_not_end_the_host(capfd: pytest.CaptureFixture[str]) -> None:
    """An exception there is fatal in pythonfmu, and the next one a crash."""
    with slave(template("python")) as one:
        one.begin()
        saved = one.getFMUstate()
        data = bytearray(one.serializeFMUstate(saved))
        data[40] ^= 1
        for wrong in (bytes(data), b"nonsense", b"[1]", b"\xff\xfe", b"{}") * 3:
            state = one.deSerializeFMUstate(wrong)
            assert one.status("setFMUstate", state) == 0
            assert one.status("doStep", 0.0, 1e-3) == 2
            one.freeFMUstate(state)
        one.setFMUstate(saved)
        one.doStep(0.0, 1e-3)
    assert "no state of this FMU" in capfd.readouterr().err
