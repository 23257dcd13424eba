"""Pairs: a pair must pay over either of its effects alone, each where the pair found it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from engine_kit import machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fit import Fit, minimise
from corexy_fmi.engine.name import _added_alone, _parts, _pays
from corexy_fmi.engine.problem import Problem
from corexy_fmi.engine.search import rank
from corexy_fmi.engine.unknowns import Hypothesis
from corexy_fmi.machine import EffectUse

FRAME = {"mass": 3.0, "frequency": 20.0, "damping_ratio": 0.04}
NOISE = 4e-6  # [m]


def begun(chosen: Problem, values: dict[str, float], iterations: int) -> Fit:
    """A fit from these parameters of its effects."""
    start = np.zeros(chosen.size)
    for k, unknown in enumerate(chosen.unknowns):
        name = unknown.key.rpartition(".")[2]
        if "." in unknown.key and name in values:
            start[k] = unknown.internal(values[name])
    return minimise(chosen, start, iterations)


def test_an_effect_whose_own_search_missed_it_is_told_alone_where_a_pair_found_it() -> None:
    """A frame that swings at 20 Hz, its own fit stuck at 36, found beside damping that is idle."""
    bare = machine()
    shown = record(
        with_effects(bare, EffectUse("frame_mode", "frame", FRAME)), rich_motion(), noise=NOISE
    )
    both = problem(shown, bare, [("belt_damping", "belts"), ("frame_mode", "frame")], NOISE)
    retuned = begun(replace(both, hypothesis=Hypothesis()), {}, 10)
    two = begun(both, FRAME | {"time": 1e-6}, 10)
    damping, frame = (Hypothesis((use,)) for use in both.hypothesis.uses)
    first = begun(replace(both, hypothesis=damping), {"time": 1e-4}, 10)
    stuck = begun(replace(both, hypothesis=frame), FRAME | {"frequency": 36.0}, 1)
    assert all(_pays(one, two, retuned) for one in _parts(two, [first, stuck]))
    alone = _added_alone(two, [first, stuck])
    assert alone.problem.hypothesis.key == (("frame_mode", "frame"),)
    assert abs(alone.value("frame_mode.frame.frequency") - FRAME["frequency"]) < 0.3
    assert rank(alone) < rank(two) < rank(stuck)
    assert not all(_pays(one, two, retuned) for one in _parts(two, [first, stuck, alone]))


def test_a_fit_of_its_own_that_is_as_good_stays() -> None:
    """Begun again where a pair that lies far off ended, it would be worse."""
    bare = machine()
    shown = record(
        with_effects(bare, EffectUse("frame_mode", "frame", FRAME)), rich_motion(), noise=NOISE
    )
    both = problem(shown, bare, [("belt_damping", "belts"), ("frame_mode", "frame")], NOISE)
    far = begun(both, FRAME | {"time": 1e-6, "frequency": 300.0}, 0)
    own = begun(replace(both, hypothesis=Hypothesis(both.hypothesis.uses[1:])), FRAME, 10)
    assert _added_alone(far, [own]) is own
