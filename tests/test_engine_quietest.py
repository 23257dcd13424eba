"""Nobody takes more for noise than the best explanations leave, nor ends dearer than it began."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from engine_kit import NOISE, fitted, machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting import fit as fitting
from corexy_fmi.engine.fitting.fit import minimise, own_noise, settle, settle_no_dearer
from corexy_fmi.engine.fitting.noise import size, white
from corexy_fmi.engine.naming import quietest
from corexy_fmi.engine.naming.worth import gained
from corexy_fmi.machine import EffectUse

LOUD = 10.0  # times the noise
TURNED = EffectUse("sensor_rotation", "sensor", {"angle": 0.01})


def noise_of(*deviations):
    return (tuple(white(d) for d in deviations),)


@pytest.fixture(scope="module")
def stuck():
    """A fit of nothing on a recording whose sensor is turned."""
    return fitted(problem(record(with_effects(machine(), TURNED), rich_motion()), machine()))


@pytest.fixture(scope="module")
def healthy():
    return fitted(problem(record(machine(), rich_motion()), machine()))


@pytest.fixture(scope="module")
def began(stuck):
    """The same under the noise of its own."""
    return minimise(own_noise(stuck), stuck.u)


def test_what_is_left_loudly_is_no_noise_under_a_ceiling(stuck):
    ceiling = noise_of(NOISE, NOISE)
    held = replace(stuck, problem=replace(stuck.problem, ceiling=ceiling))
    assert size(own_noise(stuck).noise) > 3 * NOISE
    assert own_noise(held).noise is ceiling


def test_a_fit_below_the_ceiling_has_the_noise_of_its_own(healthy):
    loud = noise_of(LOUD * NOISE, LOUD * NOISE)
    held = replace(healthy, problem=replace(healthy.problem, ceiling=loud))
    assert size(own_noise(held).noise) == size(own_noise(healthy).noise) < 1.1 * NOISE


@pytest.fixture
def dear(stuck, monkeypatch):
    """Noise that is too small for what a fit leaves, as another recording's may be, in which it
    settles.
    """
    imposed = noise_of(NOISE, NOISE)
    monkeypatch.setattr(fitting, "own_noise", lambda fit: replace(fit.problem, noise=imposed))
    return imposed


def test_a_fit_settles_no_dearer_than_it_began(stuck, began, dear):
    assert settle(began).cost > began.cost + 100
    ended = settle_no_dearer(began)
    assert ended.cost <= began.cost + 1e-3
    assert ended.problem.noise is began.problem.noise


def test_a_finalist_costs_no_more_than_under_the_noise_of_the_first(stuck, began, dear):
    ended = settle_no_dearer(stuck, began.problem.noise)
    assert ended.cost <= began.cost + 0.1
    assert ended.problem.noise is began.problem.noise
    assert settle_no_dearer(stuck, dear).problem.noise is dear


def test_under_a_ceiling_a_fit_settles_however_dear_that_is(began):
    ceiling = noise_of(NOISE, NOISE)
    held = replace(began, problem=replace(began.problem, ceiling=ceiling))
    for ended in (settle_no_dearer(held), settle_no_dearer(held, began.problem.noise)):
        assert ended.problem.noise is ceiling
        assert ended.cost > began.cost + 100


def told(cost, left, floor=0.0):
    return SimpleNamespace(cost=cost, left=left, floor=floor)


@pytest.fixture
def plain(monkeypatch):
    """Fits that tell what they leave [m], without a price for parameters."""
    monkeypatch.setattr(quietest, "rank", lambda fit: fit.cost)
    monkeypatch.setattr(quietest, "remains", lambda fit: fit.left)
    monkeypatch.setattr(quietest, "form_floor", lambda fit: fit.floor)
    monkeypatch.setattr(
        quietest, "held_to", lambda quiet, base, fits, pairs, mapper: (quiet, fits, pairs)
    )


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("fits", "sets"),
    [
        ([(-900.0, 4e-5), (-890.0, 2e-5)], 1),  # the second leaves half of what the first does
        ([(-900.0, 2.5e-5), (-890.0, 2e-5)], None),  # about as much
        ([(-900.0, 4e-5), (-200.0, 2e-5)], None),  # that gains too small a share of the best
        ([(-900.0, 2e-5), (-200.0, 9e-5)], None),  # and so does what leaves more
        ([(-5.0, 4e-5), (-4.0, 2e-5)], None),  # neither is told
        ([], None),
    ],
)
def test_the_quietest_of_those_that_gain_a_fair_share_is_the_ceiling(fits, sets):
    base, found = told(0.0, 1e-4), [told(*each) for each in fits]
    first, _ = quietest.under_ceiling(base, found, map)
    assert first is (base if sets is None else found[sets])


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize(
    ("pair", "least", "is_quieter"),
    [
        ((-300.0, 7e-6), 40.0, True),
        ((-300.0, 15e-6), 40.0, False),  # not by far
        ((-5.0, 7e-6), 2.0, False),  # it gains nothing under either noise
        ((-30.0, 7e-6), 40.0, False),  # too small a share of what the first one does
        ((-300.0, 7e-6, 400.0), 40.0, False),  # the shape of smooth friction may fake that
    ],
)
def test_a_pair_is_quieter_if_it_gains(pair, least, is_quieter):
    one, two = told(0.0, 2e-5), told(*pair)
    assert quietest.quieter(one, [two], least) is (two if is_quieter else None)


def test_those_far_louder_are_fitted_again_under_the_ceiling(stuck, healthy):
    truth = fitted(problem(record(with_effects(machine(), TURNED), rich_motion()), machine(),
                           [("sensor_rotation", "sensor")]))  # fmt: skip
    base, (first, second), _ = quietest.held_to(healthy, stuck, [stuck, healthy], [truth], map)
    assert base.cost == stuck.cost
    assert base.problem.noise is stuck.problem.noise
    assert size(base.problem.ceiling) < 1.1 * NOISE
    assert first.problem.noise is healthy.problem.noise is not base.problem.ceiling
    assert first.u is healthy.u
    assert second.problem.noise is second.problem.ceiling
    assert np.isfinite(second.cost)


def test_shares_are_of_what_the_quietest_gains_by_its_own_noise(stuck, healthy):
    """Lost squares are far more than nats: of 1108 by play 1020 by a scale beside it are a lot."""
    louder = replace(stuck, cost=stuck.cost - 50.0)
    base, (first, second), _ = quietest.held_to(healthy, stuck, [louder, healthy], [], map)
    assert gained(first, base) == base.cost - first.cost
    assert second.problem.noise is base.problem.ceiling
    assert first.problem.noise is not base.problem.ceiling
