"""Two causes that only show together: found by their signatures, two by two."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from engine_kit import ASIDE, machine, named, record, with_effects

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.naming import jointly as together
from corexy_fmi.engine.naming.specification import NOTHING, Leftover
from corexy_fmi.machine import EffectUse
from corexy_fmi.motion import chain, line, rest

REFUTED = Leftover(45.0, 8.0, "")


class Plain:
    """Beyond a retuning that can do nothing: what is left is the residual itself."""

    def __init__(self, residual):
        self.residual = residual

    def of(self, changes):
        return changes @ self.residual, changes @ changes.T


def signature(name, change, lower=-1.0):
    """A cause of one size, its start 1e-3."""
    size = SimpleNamespace(
        name="angle", neutral=0.0, log=False, lower=lower, upper=1.0, periodic=False
    )
    effect = SimpleNamespace(name=name, size=size, sizes=(size,), parameters=(size,))
    instance = SimpleNamespace(effect=effect, location="sensor")
    return together.Signature(instance, [{"angle": 1e-3}], np.atleast_2d(change), 5.0)


@pytest.fixture
def starts(monkeypatch):
    """Which pairs are promised for a residual, with the factors of both."""

    def promised(residual, seen, least):
        monkeypatch.setattr(together, "beyond", lambda base: Plain(residual))
        monkeypatch.setattr(
            together,
            "_start",
            lambda base, one, two, factors: (
                one.instance.effect.name,
                two.instance.effect.name,
                factors,
            ),
        )
        return together._promising(None, seen, least)

    return promised


def test_what_cancels_is_found_by_both(starts):
    """Along x they are opposite; the residual holds what is left along y alone."""
    noise = np.random.default_rng(3).standard_normal(400)
    x, y = np.zeros((2, 400))
    x[:200], y[200:] = 4 * np.sin(np.arange(200)), np.cos(np.arange(200))
    seen = [signature("rotation", x + y), signature("skew", x - y), signature("other", noise[::-1])]
    residual = noise - 0.5 * (seen[0].change[0] - seen[1].change[0])
    gains = [together.gain_many(*Plain(residual).of(s.change))[0] for s in seen]
    assert max(gains) < 10.0
    [(one, two, factors)] = starts(residual, seen, 20.0)
    assert (one, two) == ("rotation", "skew")
    assert factors == pytest.approx([0.5, -0.5], abs=0.15)


def test_a_cause_and_nearly_the_same_are_no_pair(starts):
    """Their difference is anything."""
    wave = np.sin(np.arange(400.0))
    other = np.cos(np.arange(400.0))
    seen = [signature("lag", wave), signature("delay", wave + 0.01 * other)]
    assert starts(30 * other, seen, 20.0) == []


def test_of_no_cause_there_is_no_pair(starts):
    assert starts(np.ones(4), [], 0.0) == []


def test_no_cause_is_tried_with_the_sign_that_its_size_has_not():
    base = SimpleNamespace(u=None, problem=SimpleNamespace(carried=lambda *_: None))
    one, two = signature("drag", np.ones(4), lower=0.0), signature("skew", np.ones(4))
    together_start = together._start
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(together, "replace", lambda problem, hypothesis: problem)
        assert together_start(base, one, two, np.array([-1.0, 1.0])) is None


def fitted(cost, left, uses=(), law=""):
    hypothesis = SimpleNamespace(uses=uses, law=law)
    return SimpleNamespace(cost=cost, left=left, problem=SimpleNamespace(hypothesis=hypothesis))


@pytest.mark.parametrize(
    ("left", "law", "tried"),
    [(NOTHING, 45.0, False), (REFUTED, 45.0, True), (NOTHING, 20.0, True)],
)
def test_pairs_are_tried_where_the_best_leaves_something_or_a_law_gains_more(
    monkeypatch, left, law, tried
):
    base, best = fitted(100.0, REFUTED), fitted(40.0, left, uses=("skew",))
    begun = []
    monkeypatch.setattr(together, "rank", lambda fit: fit.cost)
    monkeypatch.setattr(together, "samples_of", lambda fit: 400)
    monkeypatch.setattr(together, "leftover", lambda fit: fit.left)
    monkeypatch.setattr(together, "_signatures", lambda *_: [])
    monkeypatch.setattr(together, "_promising", lambda base, seen, least: begun.append(least) or [])
    assert together.jointly(base, [best, fitted(law, NOTHING, law="y")], [], map) == []
    assert begun == ([60.0 + together.THRESHOLD] if tried else [])


@pytest.mark.long
def test_a_rotation_and_a_skew_that_cancel_along_x_are_both_named():
    """Alone either harms x more than it mends y; a force without a name along y had won."""
    corners = [(0, 0), (0.012, 0.04), (-0.012, 0.035), (0.01, -0.04), (-0.01, 0.03), (0, 0)]
    legs = zip(pairwise(corners), (0.05, 0.08, 0.12, 0.06, 0.1), strict=True)
    moves = [line(start, end, speed, 2.0) for (start, end), speed in legs]
    motion = chain(rest((0, 0), 0.1), *moves, rest((0, 0), 0.3))
    turn = EffectUse("sensor_rotation", "sensor", {"angle": -6e-4})
    skew = EffectUse("axis_skew", "sensor", {"angle": 6e-4})
    truth = with_effects(machine("light_bench"), turn, skew, **ASIDE)
    shown = record(truth, motion, noise=1.2e-5)
    document = diagnose([shown], [], machine("light_bench"), jobs=2).document
    assert named(document) == {("sensor_rotation", "sensor"), ("axis_skew", "sensor")}
