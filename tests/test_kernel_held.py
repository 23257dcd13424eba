"""What the kernel finds once and keeps: a law's own numbers, the segment of a free-form law, and
steps under voltages in registers.
"""

from dataclasses import replace

import numpy as np
import pytest
from kernel_helpers import STEP, angles_of, excitation, lively, run, start_values, vector

from corexy_fmi.effects import catalogue
from corexy_fmi.kernel.call import OUTPUTS, Excitation, run_lanes
from corexy_fmi.kernel.layout import LAW_KINDS, bundled_layout
from corexy_fmi.kernel.reference_run import run_reference
from corexy_fmi.machine import FreeForm
from corexy_fmi.simulate import _write_free_form

REACH = {"vx": 0.5, "vy": 0.5, "x": 0.01, "y": 0.01, "phi1": 2.0, "phi2": 2.0, "t": 0.08}


def with_law(values, acts, argument, location="x", knots=24, size=2.0):
    """A vector with a free-form law of many knots, over what a short run reaches."""
    values, reach = values.copy(), REACH[argument]
    places = np.linspace(0.0 if argument == "t" else -reach, reach, knots)
    heights = size * np.sin(np.arange(knots))
    if acts == "friction":
        heights = np.abs(heights)
    law = FreeForm(location, argument, tuple(places), tuple(heights), acts)
    _write_free_form(bundled_layout(), values, law)
    return values


@pytest.mark.parametrize("machine", ["yin2018", "gt2_printer"])
@pytest.mark.parametrize("fidelity", ["full", "reduced", "condensed"])
@pytest.mark.parametrize("mode", ["closed_loop", "voltages"])
@pytest.mark.parametrize("sets", [1, 8])
@pytest.mark.parametrize("smoothing", [0.0, 1e-3])
def test_volts_in_registers_equal_steps_one_by_one(machine, fidelity, mode, sets, smoothing):
    """A law of nothing asks for steps one by one."""
    bare = vector(machine, friction_smoothing=smoothing)
    nothing = with_law(bare, "force", "vx", knots=2, size=0.0)
    given = replace(excitation(True), mode=mode)
    options = {"fidelity": fidelity, "dc": True, "limit": STEP, "channels": OUTPUTS}
    quick, slow = (
        run_lanes(bundled_layout(), given, np.tile(v, (sets, 1)), **options)
        for v in (bare, nothing)
    )
    assert np.array_equal(quick, slow)
    assert np.ptp(quick[:, 0], axis=1).min() > 1e-4


@pytest.mark.parametrize(("acts", "argument"), LAW_KINDS)
def test_a_law_is_the_same_beside_laws_of_other_kinds(acts, argument):
    """Where kinds differ each lane looks its segment up anew, else it keeps to the last one."""
    sets = np.array([with_law(vector(), a, n) for a, n in LAW_KINDS])
    own = LAW_KINDS.index((acts, argument))
    together = run_lanes(bundled_layout(), excitation(), sets, limit=STEP)
    alone = run(excitation(), sets[own], limit=STEP)
    np.testing.assert_allclose(alone, together[own], rtol=0, atol=1e-15)
    assert np.abs(alone - run(excitation(), vector(), limit=STEP)).max() > 1e-8


@pytest.mark.parametrize(
    ("name", "location"),
    [("belt_relaxation", "belts"), ("frame_mode", "frame"), ("sensor_lag", "sensor")],
)
def test_what_a_law_holds_follows_the_length_of_the_step(name, location):
    """Rows of different lengths, each cut into steps of its own."""
    random = np.random.default_rng(5)
    time, path = lively(60)
    uneven = np.cumsum(random.uniform(5e-5, 3e-3, len(time)))
    given = Excitation(uneven, *angles_of(path).T)
    values = vector(effects=[(name, location, start_values(catalogue()[name]))])
    slow = run_reference(bundled_layout(), given, values, limit=STEP)
    for found, expected in zip(run(given, values, limit=STEP), slow.values(), strict=True):
        assert np.abs(found - expected).max() < 1e-10
