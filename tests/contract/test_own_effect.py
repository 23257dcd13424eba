"""A machine with an effect of the user's own, on every command that runs a machine."""

import sys
from pathlib import Path

import numpy as np
import pytest

from corexy_fmi.machine import load_machine, machine_to_toml
from corexy_fmi.recording import read_recording

sys.path.insert(0, str(Path(__file__).parents[1]))

from own_effects import LAG

OWN = '\n[[effects]]\nname = "my_lag"\nlocation = "sensor"\nparameters = { time_constant = 0.01 }\n'
RUN = ("rectangle", "--width", 0.02, "--height", 0.015, "--speed", 0.05)


@pytest.fixture
def folder(tmp_path):
    """The effect, and a machine that has it."""
    (tmp_path / "lag.py").write_text(LAG)
    (tmp_path / "mine.toml").write_text(machine_to_toml(load_machine("yin2018")) + OWN)
    return tmp_path


@pytest.mark.parametrize("plant", ["model", "fmu"])
def test_it_runs(corexy, folder, plant):
    """x falls behind by 10 ms on the first side: 0.5 mm."""
    both = ("--machine", "mine.toml", "--effects", "lag.py", "--plant", plant)
    assert corexy(*RUN, *both, "--out", "mine.csv").returncode == 0
    assert corexy(*RUN, "--plant", plant, "--out", "bare.csv").returncode == 0
    mine, bare = (read_recording(folder / name) for name in ("mine.csv", "bare.csv"))
    row = np.searchsorted(mine.time, 0.35)
    assert bare["x"][row] - mine["x"][row] == pytest.approx(0.05 * 0.01, rel=0.02)
    assert corexy("simulate", "mine.csv", *both, "--out", "again.csv").returncode == 0
    again = read_recording(folder / "again.csv")
    np.testing.assert_allclose(again["x"], mine["x"], atol=1e-9)


def test_the_fmu_that_is_built_has_it(corexy, folder):
    done = corexy("build", "--machine", "mine.toml", "--effects", "lag.py", "--out", "made")
    assert done.returncode == 0
    assert (folder / "made" / "CoreXY.fmu").stat().st_size > 0


@pytest.mark.parametrize("words", [("simulate", "x.csv", "--out", "y.csv"), RUN, ("build",)])
def test_without_the_file_it_is_unknown(corexy, folder, words):
    rest = () if words[0] != "rectangle" else ("--out", "y.csv")
    (folder / "x.csv").write_text("time,phi1,phi2\n0,0,0\n1,1,0\n2,2,0\n")
    done = corexy(*words, *rest, "--machine", "mine.toml")
    assert done.returncode == 2
    assert "my_lag" in done.stderr
    assert "Traceback" not in done.stderr
