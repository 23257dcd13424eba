"""Idlers between damped belts: steps far longer than their rates, and the same motion."""

import numpy as np
import pytest
from kernel_helpers import assert_same, drive, lively, polyline, run, start_values, vector

from corexy_fmi.effects import catalogue
from corexy_fmi.kernel.call import step_limit
from corexy_fmi.kernel.layout import bundled_layout

CLOSE = 2e-6  # [m], as the automatic step keeps a motion


def damped(time):
    """The effect, as vectors take it."""
    return "belt_damping", "belts", (time,)


@pytest.mark.parametrize("smoothing", [0.0, 1e-3])
@pytest.mark.parametrize("time", [1e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("machine", ["yin2018", "light_bench", "gt2_printer"])
def test_the_automatic_step_keeps_the_motion(machine, time, smoothing):
    """Whichever way friction rises.  Extrapolated rates of gt2_printer's idlers would ask for a
    step twenty times as short at 5 ms.
    """
    values = vector(machine, [damped(time)], friction_smoothing=smoothing)
    given = drive(*lively(60), radius=values[0])
    limit = step_limit(bundled_layout(), values)
    assert limit >= 0.4 * step_limit(bundled_layout(), vector(machine))
    rough, fine = (run(given, values, limit=h)[:2] for h in (limit, limit / 32))
    assert np.abs(rough - fine).max() < CLOSE


LAWFUL = [
    (e.name, next(iter(e.locations)))
    for e in catalogue().values()
    if {law.port for law in e.laws} & {"tension", "runout"}
]


@pytest.mark.parametrize("smoothing", [0.0, 1e-3])
@pytest.mark.parametrize("use", LAWFUL, ids="-".join)
def test_laws_on_tensions_keep_it_too(use, smoothing):
    """And the plain Python agrees."""
    effects = [(*use, start_values(catalogue()[use[0]], 1)), damped(3e-3)]
    values = vector(effects=effects, friction_smoothing=smoothing)
    given = drive(*lively(60), radius=values[0])
    assert_same(bundled_layout(), given, values)
    limit = step_limit(bundled_layout(), values)
    rough, fine = (run(given, values, limit=h)[:2] for h in (limit, limit / 32))
    assert np.abs(rough - fine).max() < CLOSE


@pytest.mark.parametrize("time", [1e-3, 5e-3])
def test_what_sticks_sticks_exactly(time):
    """Motors stop, the stage comes to rest, and then nothing creeps."""
    values = vector("light_bench", [damped(time)])
    given = drive(*polyline([(0, 0), (0.02, 0.01)], 0.1, rest=1.0), radius=values[0])
    still = run(given, values, channels=("x", "y", "vx", "vy"))[:, -300:]
    assert np.all(still[2:] == 0)
    assert np.all(still[:2] == still[:2, :1])


def test_more_damping_rings_less():
    """Behind a stop, as fast as the ring of undamped belts goes on."""
    swings = []
    for time in (0.0, 1e-3, 5e-3):
        values = vector("light_bench", [damped(time)])
        given = drive(*polyline([(0, 0), (0.02, 0.0)], 0.2, rest=0.3), radius=values[0])
        rings = run(given, values, channels=("x",))[0, given.time > 0.11]
        swings.append(float(np.ptp(rings)))
    assert swings[0] > swings[1] > swings[2]
