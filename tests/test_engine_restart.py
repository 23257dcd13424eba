"""Scattered starts, their mixtures, and that neither depends on how many run at once."""

import numpy as np
import pytest
from engine_kit import DELAY, machine, problem, record, short_motion, with_effects

from corexy_fmi.engine.fitting import restart
from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.naming import again

SMALL = restart.Breadth(16, 1, 8)


@pytest.fixture(scope="module")
def chosen():
    """A delay over a short recording, the delay among the unknowns."""
    recording = record(with_effects(machine(), DELAY), short_motion())
    return problem(recording, machine(), (("sensor_delay", "sensor"),))


def test_scattered_starts_keep_the_first_the_nuisances_and_the_bounds(chosen):
    around = 0.1 * np.ones(chosen.size)
    starts = restart.scattered(chosen, around, 64)
    low, high = chosen.limits()
    assert (starts >= low).all()
    assert (starts <= high).all()
    assert starts[0] == pytest.approx(np.clip(around, low, high))
    first = chosen.first_own(0)
    assert np.ptp(starts[:, first:], axis=0).max() == 0.0
    stiff = [x.key for x in chosen.unknowns].index("belt_axial_stiffness")
    assert np.std(starts[:, stiff]) == pytest.approx(chosen.unknowns[stiff].prior_std, rel=0.1)


def test_each_unknown_of_a_mixture_is_of_either_parent(chosen):
    ends = np.arange(3)[:, None] * np.ones(chosen.size)
    children = restart.mixed([Fit(chosen, u, 0.0, np.zeros(1)) for u in ends], 32)
    assert children.shape == (32, chosen.size)
    assert set(np.unique(children)) == {0.0, 1.0, 2.0}
    assert all(len(np.unique(child)) <= 2 for child in children)


def test_costs_of_channels_add_up_and_depend_on_no_company(chosen, monkeypatch):
    """The whole is the channels and the priors; sets in other groups give the same bits."""
    starts = restart.scattered(chosen, np.zeros(chosen.size), 16)
    whole, *channels = restart._parts(chosen, starts)
    prior = 0.5 * np.sum((starts * chosen.prior[1]) ** 2, axis=1)
    assert np.sum(channels, axis=0) + prior == pytest.approx(whole)
    monkeypatch.setattr(restart, "TOGETHER", 8)
    assert np.array_equal(restart._parts(chosen, starts), [whole, *channels])


def test_the_same_fits_each_time_and_none_worse_than_the_first(chosen):
    around = np.zeros(chosen.size)
    one, other = (restart.begun(chosen, around, SMALL) for _ in range(2))
    assert [fit.cost for fit in one] == [fit.cost for fit in other]
    assert restart.best(one).cost <= one[0].cost


def test_shapes_begin_where_the_effects_file_says(chosen):
    """The gap as it was fitted with each grip and hold; nothing where there is no shape."""
    assert len(restart.declared(chosen, np.zeros(chosen.size))) == 0
    play = problem(record(machine(), short_motion()), machine(), (("backlash", "motor1"),))
    keys = [x.key for x in play.unknowns]
    gap, grip, hold = (keys.index(f"backlash.motor1.{n}") for n in ("gap", "grip", "hold"))
    around = np.zeros(play.size)
    around[gap] = 0.7
    starts = restart.declared(play, around)
    assert (starts[:, gap] == 0.7).all()
    values = np.array(
        [[play.unknowns[k].value(u[k]) for k in (grip, hold)] for u in starts], dtype=float
    )
    expected = [(a, b) for a in (1.0, 1e-3, 1e-5) for b in (0.0, 1e-3)]
    assert values == pytest.approx(np.array(expected))


def test_a_fit_whose_nominal_parameters_went_astray_begins_anew(chosen):
    """Belts four deviations too soft, a delay beside them: it ends near both; a near one stays."""
    at = {
        key: chosen.keys.index(key) for key in ("belt_axial_stiffness", "sensor_delay.sensor.delay")
    }
    u = np.zeros(chosen.size)
    u[at["belt_axial_stiffness"]] = -4 * chosen.unknowns[at["belt_axial_stiffness"]].prior_std
    lost = minimise(chosen, u, 0)
    found = again.recentred(lost, map)
    assert found.cost < lost.cost - 100
    assert abs(found.u[at["belt_axial_stiffness"]]) < 0.5 * abs(u[at["belt_axial_stiffness"]])
    delay = chosen.unknowns[at["sensor_delay.sensor.delay"]]
    assert delay.value(found.u[at["sensor_delay.sensor.delay"]]) == pytest.approx(4e-3, rel=0.1)
    near = minimise(chosen, np.zeros(chosen.size), 0)
    assert again.recentred(near, map) is near
