"""Friction that breaks away is begun at its full size where nothing else pays."""

from dataclasses import replace

import numpy as np
from engine_kit import STRIBECK, machine, other_motion, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting.fit import Fit, minimise, settle
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.bold import bold_fits
from corexy_fmi.engine.naming.candidates import hypotheses
from corexy_fmi.engine.naming.entries import THRESHOLD
from corexy_fmi.engine.naming.name import _wants_more, laws_once
from corexy_fmi.engine.naming.search import rank
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

CAUSES = ({"angle": 2e-3}, {"coefficient": 60.0})  # of a rotation, of a drag


def retuned(*uses, motion=rich_motion):
    shown = record(with_effects(machine(), *uses), motion())
    return retune(bundled_layout(), machine(), problem(shown, machine()).runs)


def tried(*uses, motion=rich_motion):
    base = retuned(*uses, motion=motion)
    return base, bold_fits(base, hypotheses(base.problem, base.u), map)


def test_a_peak_is_found_from_its_declared_size():
    base, found = tried(STRIBECK)
    best = min((fit for fit in found if fit.problem.hypothesis.uses), key=rank)
    assert base.cost - rank(best) > 10 * THRESHOLD
    assert best.problem.hypothesis.key in [(("stribeck_friction", n),) for n in ("x", "xy")]
    ratio = best.value(f"stribeck_friction.{best.problem.hypothesis.uses[0].location}.static_ratio")
    assert abs(ratio - 2.5) < 0.5
    assert np.isfinite([fit.cost for fit in found]).all()


def test_a_law_finds_a_peak_that_one_begun_at_nothing_does_not():
    base = retuned(STRIBECK)
    (law,) = (h for h in hypotheses(base.problem, base.u) if _over_own_speed(h, "x"))
    (bold,) = bold_fits(base, [law], map)
    timid = replace(base.problem, hypothesis=law)
    begun = minimise(timid, timid.carried(base.problem, base.u))
    assert base.cost - bold.cost > 1.5 * (base.cost - begun.cost)


def test_of_a_law_found_twice_the_end_with_less_raw_mismatch_goes_on():
    """Each end has a noise of its own, by which the worse one may cost less."""
    base = retuned(STRIBECK)
    (law,) = (h for h in hypotheses(base.problem, base.u) if _over_own_speed(h, "x"))
    (near,) = bold_fits(base, [law], map)
    problem = replace(base.problem, hypothesis=law)
    start = problem.carried(base.problem, base.u)
    far = Fit(problem, start, near.cost - 100.0, problem.residual(start[None])[0])
    assert laws_once([far, base, near]) == [base, near]
    assert laws_once([base, far]) == [base, far]


def _over_own_speed(hypothesis, axis):
    law = hypothesis.law
    return law is not None and (law.location, law.argument) == (axis, f"v{axis}")


def test_without_one_nothing_is_kept_that_pays():
    base, found = tried(motion=other_motion)
    assert all(base.cost - rank(fit) < THRESHOLD for fit in found)


def test_a_right_set_of_causes_wants_no_bold_starts():
    """Nothing at all does, and one cause of two, which leaves the other."""
    uses = [("sensor_rotation", "sensor"), ("quadratic_drag", "x")]
    base = retuned(*(EffectUse(*u, v) for u, v in zip(uses, CAUSES, strict=True)))
    layout = base.problem.layout
    one, both = ([layout.find(*u) for u in uses[:n]] for n in (1, 2))

    def fitted(of):
        said = replace(base.problem, hypothesis=Hypothesis(tuple(of)))
        return settle(minimise(said, said.carried(base.problem, base.u)))

    first, second = fitted(one), fitted(both)
    assert base.cost - rank(first) > 10 * THRESHOLD
    assert _wants_more(base, [])
    assert _wants_more(base, [first])
    assert not _wants_more(base, [second, first])
