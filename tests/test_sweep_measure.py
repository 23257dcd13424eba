"""What a sweep measures, against the corner table and closed forms."""

import numpy as np
import pytest
from sweep_kit import SHAPE, plan

from corexy_fmi.corners import corner_table
from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.sweep.chunk import draw, run_chunk
from corexy_fmi.sweep.measure import MEASURES, measured, settling, windows
from corexy_fmi.sweep.vary import base_vector


@pytest.mark.parametrize("machine", ["yin2018", "yin2018_dc", "gt2_printer"])
@pytest.mark.parametrize("accel", [None, 2.0])
def test_measures_are_those_of_corner_table(machine, accel):
    shape = Rectangle(0.02, 0.015, 0.08, 2, accel)
    what = plan(sets=12, machine=machine, shape=shape)
    found, drive, drawn = run_chunk(what, 0), what.excitation(), draw(what, 0)
    for n in range(12):
        vector = base_vector(what.machine)
        for r in what.ranges:
            vector[r.place.index] = drawn[r.place.key][n]
        path = run_lanes(
            bundled_layout(), drive, np.tile(vector, (8, 1)), dc=what.machine.drive == "dc"
        )[0]
        table = corner_table(
            Recording("run", drive.time, dict(zip("xy", path, strict=True))), shape
        )
        for turn, short in (("x->y", "xy"), ("y->x", "yx")):
            errors = [c.contour_error for c in table if c.turn == turn]
            beyond = max(c.overshoot for c in table if c.turn == turn)
            worst = max(errors, key=abs)
            assert found[f"contour_error_{short}"][n] == pytest.approx(worst, rel=1e-3, abs=1e-8)
            assert found[f"overshoot_{short}"][n] == pytest.approx(beyond, rel=1e-3, abs=1e-8)


def test_settling_of_known_decays():
    """exp(-t / tau) from 1 mm is within 10 um after tau ln 100; an endless swing never is."""
    time_, taus = np.linspace(0, 1.5, 15001), np.array([0.01, 0.05])
    after = np.maximum(time_ - 1.0, 0)
    paths = np.zeros((3, 2, len(time_)))
    paths[:2, 0] = 1e-3 * np.exp(-after / taus[:, None])
    paths[2, 1] = 1e-3 * np.cos(300 * after)
    found = settling(paths, time_, 1.0, 1e-5)
    assert found[:2] == pytest.approx(taus * np.log(100), abs=2e-4 + 1e-4)
    assert np.isnan(found[2])


def test_a_path_that_broke_down_is_nan_and_warns_of_nothing():
    time_ = plan().order().time
    paths = np.full((2, 2, len(time_)), np.nan)
    found = measured(SHAPE, windows(SHAPE, time_), time_, paths, 1e-5)
    assert all(np.isnan(found[name]).all() for name in MEASURES)
