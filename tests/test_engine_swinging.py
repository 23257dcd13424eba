"""A force in time may have swung the stage before its first row; then all runs are led in."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from engine_kit import machine, problem, record, short_motion, with_effects

from corexy_fmi.effects import catalogue
from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.naming.swinging import LEAD, _in_time, alike, held, swinging, told
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse
from corexy_fmi.motion import command
from corexy_fmi.simulate import simulate

FORCE = EffectUse("periodic_disturbance", "y", {"amplitude": 4.0, "frequency": 5.5, "phase": -2.0})
QUIET = 1e-6


def recording(before):
    """A stage that a force shook for so many rows before its recording began, its time the same."""
    truth, motion = with_effects(machine(), FORCE), short_motion()
    order = command(motion, truth.parameters["pulley_radius"], name="t.csv")
    channels = {n: np.r_[np.full(before, v[0]), v] for n, v in order.channels.items()}
    time = np.r_[np.arange(-before, 0) * 1e-3, order.time]
    response = simulate(truth, replace(order, time=time, channels=channels))
    random = np.random.default_rng(2)
    seen = {n: response[n][before:] + QUIET * random.normal(size=len(order)) for n in "xy"}
    return replace(order, channels=order.channels | seen)


def fitted(before):
    """The retuned machine, the force's fit from its truth, and a fit of something else."""
    asked = problem(recording(before), machine(), std=QUIET, pinned=True)
    base = minimise(asked, np.zeros(asked.size))
    uses = problem(
        recording(before), machine(), [("periodic_disturbance", "y")], std=QUIET, pinned=True
    )
    u = np.zeros(uses.size)
    for k, unknown in enumerate(uses.unknowns):
        name = unknown.key.split(".", 2)[-1].partition("@")[0]
        u[k] = unknown.internal(FORCE.parameters[name]) if name in FORCE.parameters else 0.0
    other = problem(recording(before), machine(), [("constant_force", "x")], std=QUIET, pinned=True)
    return base, [minimise(uses, u, 30), minimise(other, np.zeros(other.size))]


def left(fit):
    """Standard deviation [m] of what a fit leaves of x and y."""
    return [float(np.std(e[0])) for e in fit.problem.errors(fit.u[None], 0)]


@pytest.mark.parametrize("before", [0, 1000], ids=["begins with the run", "shook it before"])
def test_runs_are_led_in_where_the_force_was_there_before(before):
    base, fits = fitted(before)
    led, found = swinging(base, fits, map)
    asked = before > 0
    assert [f.problem.runs[0].excitation.lead for f in (led, *found)] == [LEAD * asked] * 3
    assert (fits[0].cost - found[0].cost > 100.0) is asked
    assert found[0].value("periodic_disturbance.y.amplitude") == pytest.approx(4.0, rel=0.03)
    assert found[0].problem.own == fits[0].problem.own  # nothing is free that was not
    assert left(led) == pytest.approx(left(base), rel=0.1)  # without a force it leads nowhere
    assert bool(told(led)) is asked
    assert [r.excitation.lead for r in alike(base.problem.runs, led)] == [LEAD * asked]


def test_nothing_is_led_in_without_a_force_in_time():
    base, fits = fitted(1000)
    assert swinging(base, fits[1:], map) == (base, fits[1:])


def test_what_moves_at_first_or_is_led_already_stays_as_it_is():
    run = problem(record(machine(), short_motion()), machine()).runs[0]
    e, ramp = run.excitation, np.arange(len(run.excitation.time)) * 1e-3
    assert held(run).excitation.lead == LEAD
    assert not held(run).moving
    for other in (replace(e, input1=ramp), replace(e, mode="voltages"), replace(e, lead=0.3)):
        kept = SimpleNamespace(excitation=other)
        assert held(kept) is kept


def test_forces_in_time_of_the_catalogue():
    """Warm friction, lost steps and a drifting clock tell the time, but push nothing."""
    found = {i.effect.name for i in bundled_layout().instances if _in_time(i)}
    assert found == {"periodic_disturbance"} <= set(catalogue())
