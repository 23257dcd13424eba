"""Every bundled machine has its readme, and still gives its reference run."""

from pathlib import Path

import numpy as np
import pytest

from corexy_fmi.machine import load_machine, machine_names, models_folder
from corexy_fmi.recording import read_recording

SAME = 1e-9  # [m]


@pytest.mark.parametrize("name", machine_names())
def test_a_machine_explains_itself(name):
    folder = Path(models_folder()) / name
    readme = (folder / "readme.md").read_text(encoding="utf-8")
    if load_machine(name).surrogate:
        assert "surrogate" in readme.lower()
    for line in (folder / "machine.toml").read_text(encoding="utf-8").splitlines():
        key, equals, value = line.partition("=")
        number = value.partition("#")[0].strip()
        if equals and number[:1].isdigit() and not line.startswith("#"):
            assert "[" in value.partition("#")[2], f"{name}: {key.strip()} has no unit"


@pytest.mark.parametrize("name", machine_names())
def test_reference_run(name):
    from corexy_fmi.simulate import simulate

    reference = read_recording(Path(models_folder()) / name / "reference.csv")
    fresh = simulate(load_machine(name), reference)
    for axis in ("x", "y"):
        assert np.abs(fresh[axis] - reference[axis]).max() < SAME
