"""The leader at places that share a part with its own; a law beside a set of several effects."""

from types import SimpleNamespace

import numpy as np
import pytest
from engine_kit import fitted, machine, problem, record, short_motion, with_effects

from corexy_fmi.engine.fitting.fit import Fit, settle
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.elsewhere import elsewhere
from corexy_fmi.engine.naming.entries import FAMILY, THRESHOLD, catalogue_first, entry_of
from corexy_fmi.engine.naming.name import _against_sets
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse


@pytest.fixture(scope="module")
def recording():
    both = EffectUse("quadratic_drag", "xy", {"coefficient": 60.0})
    return record(with_effects(machine(), both), short_motion(), noise=2e-6)


def drag(*places):
    layout = bundled_layout()
    return [Hypothesis((layout.find("quadratic_drag", place),)) for place in places]


def test_an_effect_is_fitted_where_a_part_is_shared_and_nowhere_else(recording):
    base = settle(fitted(problem(recording, machine())))
    leader = entry_of(
        base, settle(fitted(problem(recording, machine(), [("quadratic_drag", "x")])))
    )
    found = elsewhere(base, [leader], drag("x", "y", "xy"), map)
    assert [e.hypothesis.key for e in found] == [
        (("quadratic_drag", "xy"),),
        (("quadratic_drag", "x"),),
    ]
    alone = entry_of(
        base, settle(fitted(problem(recording, machine(), [("quadratic_drag", "xy")])))
    )
    assert found[0].gain == pytest.approx(alone.gain, abs=0.1)
    assert found[1] is leader


@pytest.mark.parametrize(("share", "tried"), [(0.35, True), (0.1, False)])
def test_in_a_set_an_effect_is_fitted_where_it_alone_explains_a_fair_share(share, tried):
    """A motor's run-out shows nearly as that of an idler on its belt."""
    runout = EffectUse("pulley_eccentricity", "motor1", {"amplitude": 5e-5, "phase": 0.5})
    turned = EffectUse("sensor_rotation", "sensor", {"angle": 1e-3})
    shown = record(with_effects(machine(), runout, turned), short_motion(), noise=2e-6)
    base = settle(fitted(problem(shown, machine())))
    uses = [("sensor_rotation", "sensor"), ("pulley_eccentricity", "pulley9")]
    leader = entry_of(base, settle(fitted(problem(shown, machine(), uses))))
    singles = [Hypothesis((bundled_layout().find("pulley_eccentricity", "motor1"),))]
    alone = SimpleNamespace(hypothesis=singles[0], gain=share * leader.gain)
    found = elsewhere(base, [leader, alone], singles, map)
    right = (*singles[0].key, ("sensor_rotation", "sensor"))
    assert (right in [tuple(sorted(e.hypothesis.key)) for e in found]) is tried
    assert not tried or found[0].gain > leader.gain + THRESHOLD


def test_a_better_end_of_a_place_is_kept(recording):
    base = settle(fitted(problem(recording, machine())))
    both = [("quadratic_drag", "xy")]
    leader = entry_of(base, settle(fitted(problem(recording, machine(), both))))
    better = SimpleNamespace(hypothesis=drag("x")[0], gain=leader.gain - 1e-3)
    assert elsewhere(base, [leader, better], drag("x"), map)[1] is better
    nothing = SimpleNamespace(hypothesis=drag("x")[0], gain=-1.0)
    assert elsewhere(base, [nothing], drag("xy"), map) == [nothing]


def entry(gain, uses=(), law=None):
    return SimpleNamespace(hypothesis=SimpleNamespace(uses=uses, law=law), gain=gain)


@pytest.mark.parametrize(
    ("uses", "gain", "first"),
    [
        (("one",), 1.1, "named"),
        (("one",), FAMILY + 0.2, "law"),
        (("one", "two"), 1.05, "named"),
        (("one", "two"), 1.2, "law"),
    ],
)
def test_a_law_must_beat_one_cause_by_a_share_and_several_by_the_threshold(uses, gain, first):
    named, law = entry(100.0, uses), entry(100.0 * gain, law=object())
    entries = sorted([named, law], key=lambda e: -e.gain)
    assert FAMILY * 100 + THRESHOLD > 120 > 100 + THRESHOLD
    assert catalogue_first(entries)[0] is {"named": named, "law": law}[first]


def test_laws_are_halved_beside_sets_only():
    one = [entry(90.0, ("one",)), entry(80.0, law=object())]
    assert _against_sets(one) is one
    assert _against_sets([]) == []


def test_a_law_is_told_by_parity_beside_a_set_with_what_that_gains(monkeypatch):
    whole = Fit(None, np.zeros(1), 50.0, np.zeros(1))
    half = Fit(SimpleNamespace(hypothesis="half of it"), np.zeros(1), 30.0, np.zeros(1))
    monkeypatch.setattr("corexy_fmi.engine.naming.name.by_parity", lambda fit: half)
    monkeypatch.setattr("corexy_fmi.engine.naming.name.rank", lambda fit: fit.cost)
    near, far = entry(95.0, law=object()), entry(10.0, law=object())
    near.fit = far.fit = whole
    pair = entry(100.0, ("one", "two"))
    found = _against_sets([pair, near, far])
    assert [e.gain for e in found] == [115.0, 100.0, 10.0]
    assert found[0].hypothesis == "half of it"
