"""At which frequencies something may swing: one regression for each, off all retuning can do."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import fitted, machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.modes import FREQUENCIES, NARROW, modes, swing
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.naming.spread import spread
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

FRAME = EffectUse("frame_mode", "frame", {"mass": 6.0, "frequency": 6.84, "damping_ratio": 0.015})
TOOL = EffectUse("tool_mode", "tool", {"mass": 0.01, "frequency": 31.0, "damping_ratio": 0.02})


def left(name, *uses, noise=1e-6, **options):
    """The retuned machine beside effects."""
    truth = with_effects(machine(name), *uses)
    recording = record(truth, rich_motion(), noise=noise, **options)
    return fitted(problem(recording, machine(name), std=noise), 4)


def against_frame(use, name):
    """Frequency [Hz] at which a frame swings with what moves on it, at the least and the most."""
    p, mass = machine(name).parameters, use.parameters["mass"]
    carried = p["carriage_mass"], p["carriage_mass"] + p["bridge_mass"]
    return [use.parameters["frequency"] * (mass / (mass + m)) ** 0.5 for m in carried]


def test_a_mass_on_a_spring_comes_to_rest_where_statics_say():
    time = np.arange(5000) * 1e-3
    bent = swing(np.full(5000, 2.0), time, 10.0, 0.05)
    assert bent[-1] == pytest.approx(2.0 / (2 * np.pi * 10.0) ** 2, rel=1e-3)
    assert np.argmax(bent) * 1e-3 == pytest.approx(0.05, abs=2e-3)  # half a period


def test_frequencies_lie_as_close_as_a_mode_is_wide():
    """None falls between two: half the distance is what a mode's width leaves."""
    apart = np.diff(np.log(FREQUENCIES))
    assert apart.max() < 3 * NARROW


@pytest.mark.parametrize(
    "options", [{}, {"tracker": 10}, {"channels": ("ax", "ay"), "noise": 2e-2}], ids=str
)
def test_a_frame_is_heard_where_it_swings_with_what_it_carries(options):
    name = "gt2_printer"
    found, (heavy, light) = modes(left(name, FRAME, **options))[0], against_frame(FRAME, name)
    assert min(light, heavy) * 0.97 < found < max(light, heavy) * 1.03


@pytest.mark.parametrize("name", ["light_bench", "gt2_printer"])
def test_a_tool_is_heard(name):
    assert modes(left(name, TOOL))[0] == pytest.approx(31.0, rel=0.06)


def test_nothing_swings_where_nothing_is_missing():
    assert modes(left("light_bench")) == ()


def test_motor_angles_alone_tell_of_no_mode():
    assert modes(left("yin2018_dc", channels=("phi1_meas", "phi2_meas"))) == ()


def test_a_mode_begins_at_the_declared_frequencies_and_where_something_swings():
    """As many starts again: those that swing crowd no declared one out."""
    offered = spread(left("gt2_printer", FRAME))
    (frame,) = (i for i in bundled_layout().instances if i.effect.name == "frame_mode")
    frequency = next(p for p in frame.effect.parameters if p.heard)
    assert set(frequency.starts) <= set(offered.starts(frame, frequency))
    assert replace(offered, swings=offered.modes).starts(frame, frequency) == offered.modes
    assert len(offered.modes) > 0


@pytest.mark.parametrize(
    ("frequency", "damping_ratio", "noise", "gain"),
    [(8.4, 0.006, 1e-5, 200.0), (12.0, 0.006, 1e-5, 150.0), (6.0, 0.015, 3e-6, 300.0)],
)
def test_a_frame_that_rings_now_and_then_is_found(frequency, damping_ratio, noise, gain):
    """From the declared starts and the tones of the whole fits ended at 60, 41 and 202 nats."""
    shape = {"frequency": frequency, "damping_ratio": damping_ratio, "mass": 6.0}
    base = left("gt2_printer", EffectUse("frame_mode", "frame", shape), noise=noise)
    (frame,) = (i for i in bundled_layout().instances if i.effect.name == "frame_mode")
    lead = screen(base, [Hypothesis((frame,))])[0]
    best = min((minimise(lead.problem, u, 12) for u in lead.starts), key=lambda fit: fit.cost)
    assert best.value("frame_mode.frame.frequency") == pytest.approx(frequency, rel=0.02)
    assert base.cost - best.cost > gain
