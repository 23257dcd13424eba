"""Where the first cause leaves something over, those behind it are begun again."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import DELAY, machine, problem, record, short_motion, with_effects

from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.naming import leaders
from corexy_fmi.engine.naming.entries import entry_of


@pytest.fixture(scope="module")
def recording():
    """A delay over a short recording."""
    return record(with_effects(machine(), DELAY), short_motion())


@pytest.fixture(scope="module")
def base(recording):
    return minimise(problem(recording, machine()), np.zeros(problem(recording, machine()).size), 0)


@pytest.fixture
def begun(monkeypatch):
    """The fits that are begun again, in order; none is changed."""
    fits = []
    monkeypatch.setattr(leaders, "recentred", lambda fit, mapper: fits.append(fit) or fit)
    monkeypatch.setattr(leaders, "shaken", lambda fit, mapper: fit)
    return fits


def entry(recording, base, name, gain, iterations=0):
    """A cause at the sensor, fitted from the machine file, and said to gain so much."""
    chosen = problem(recording, machine(), ((name, "sensor"),))
    fit = minimise(chosen, np.zeros(chosen.size), iterations)
    return replace(entry_of(base, fit), gain=gain)


@pytest.mark.parametrize(("share", "count"), [(1.1, 2), (0.9, 1)])
def test_those_not_far_behind_one_that_leaves_much_are_begun_again(
    recording, base, begun, share, count
):
    """A scale for a delay leaves nearly all of it."""
    ahead = entry(recording, base, "sensor_scale", 1000.0)
    behind = entry(recording, base, "sensor_lag", share * leaders.FAR_BEHIND * 1000)
    leaders.leaders(base, [ahead, behind], map)
    assert begun == [ahead.fit, behind.fit][:count]


def test_none_is_begun_again_behind_one_that_leaves_nothing(recording, base, begun):
    ahead = entry(recording, base, "sensor_delay", 1000.0, 15)
    behind = entry(recording, base, "sensor_scale", 900.0)
    leaders.leaders(base, [ahead, behind], map)
    assert not begun


def test_who_was_led_astray_leads_once_begun_again(recording, base):
    """Belts four deviations too soft stood for most of a delay."""
    chosen = problem(recording, machine(), (("sensor_delay", "sensor"),))
    u, k = np.zeros(chosen.size), chosen.keys.index("belt_axial_stiffness")
    u[k] = -4 * chosen.unknowns[k].prior_std
    lost = replace(entry_of(base, minimise(chosen, u, 0)), gain=900.0)
    ahead = entry(recording, base, "sensor_scale", 1000.0)
    first = leaders.leaders(base, [ahead, lost], map)[0]
    assert first.hypothesis.key == lost.hypothesis.key
    assert first.fit.cost < lost.fit.cost - 100


@pytest.mark.parametrize(("share", "better"), [(0.95, True), (0.8, False)])
def test_a_rival_hardly_behind_is_begun_where_the_first_one_ended(
    recording, base, begun, share, better
):
    """A lag does for a delay, but not beside belts that are four deviations too soft."""
    ahead = entry(recording, base, "sensor_delay", 1000.0, 15)
    chosen = problem(recording, machine(), (("sensor_lag", "sensor"),))
    u = np.zeros(chosen.size)
    u[chosen.keys.index("sensor_lag.sensor.time_constant")] = 1.0
    k = chosen.keys.index("belt_axial_stiffness")
    u[k] = -4 * chosen.unknowns[k].prior_std
    rival = replace(entry_of(base, minimise(chosen, u, 0)), gain=1000.0 * share)
    found = {e.hypothesis.key: e for e in leaders.leaders(base, [ahead, rival], map)}
    assert (found[rival.hypothesis.key].fit.cost < rival.fit.cost - 100) == better
