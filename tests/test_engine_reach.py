"""Data kept back judge a free-form law where training has been, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import fitted, machine, other_motion, problem, record, rich_motion

from corexy_fmi.effects import catalogue
from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.samples import Run, make_run
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.free_form import LawShape
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.reach import beyond_reach, within_reach
from corexy_fmi.machine import FreeForm
from corexy_fmi.simulate import simulate

KNOTS = tuple(np.linspace(-0.01, 0.01, 5).tolist())


def law_fit(*laws: LawShape) -> Fit:
    """A short fit of laws to a motion over x from -0.024 to 0.025 m."""
    run = record(machine(), other_motion())
    hypothesis = Hypothesis(law=laws[0], beside=laws[1] if laws[1:] else None)
    return fitted(replace(problem(run, machine()), hypothesis=hypothesis), 2)


def kept() -> Run:
    """A run kept back that goes on to x = 0.03 m."""
    return make_run(record(machine(), rich_motion(), "judge.csv", seed=2), machine(), "holdout")


@pytest.mark.parametrize("argument", ["x", "vy", "phi1", "t"])
def test_samples_are_judged_where_training_reached_the_argument(argument):
    fit, run = law_fit(LawShape("x", argument, KNOTS, 0.1)), kept()
    (cut,) = within_reach(fit, [run])

    def values(recording):
        name = {"x": "x"}.get(argument, argument)
        return recording.time if name == "t" else simulate(machine(), recording)[name]

    seen, asked = values(fit.problem.runs[0].recording), values(run.recording)
    span = np.ptp(seen)
    inside = (asked > seen.min() + 0.05 * span) & (asked < seen.max() - 0.05 * span)
    outside = (asked < seen.min() - 0.05 * span) | (asked > seen.max() + 0.05 * span)
    assert outside.any()
    for samples, all_of_it in zip(cut.samples, run.samples, strict=True):
        assert set(np.flatnonzero(inside)) <= set(samples.index)
        assert not outside[samples.index].any()
        assert set(samples.index) < set(all_of_it.index)
        assert (samples.value == run.recording.channels[samples.channel][samples.index]).all()
        assert argument == "t" or samples.breaks.sum() > all_of_it.breaks.sum()
    told = beyond_reach([run], [cut])
    assert f"{1 - cut.count / run.count:.0%} of the data kept back say nothing" in told


def test_both_laws_must_have_been_there():
    run = kept()
    one = law_fit(LawShape("x", "x", KNOTS, 0.1))
    both = law_fit(LawShape("x", "x", KNOTS, 0.1), LawShape("y", "t", KNOTS, 0.1))
    (cut,), (less,) = within_reach(one, [run]), within_reach(both, [run])
    assert less.count < cut.count < run.count


def test_where_training_has_been_or_no_law_was_fitted_nothing_is_left_out():
    same = make_run(record(machine(), other_motion(), "judge.csv", seed=2), machine(), "holdout")
    assert within_reach(law_fit(LawShape("x", "x", KNOTS, 0.1)), [same]) == [same]
    plain, run = fitted(problem(record(machine(), other_motion()), machine()), 2), kept()
    assert within_reach(plain, [run]) == [run]
    assert beyond_reach([run], [run]) == ""


def test_a_run_that_training_never_met_is_not_asked():
    late = record(machine(), rich_motion(), "judge.csv")
    run = make_run(replace(late, time=late.time + 100.0), machine(), "holdout")
    assert within_reach(law_fit(LawShape("x", "t", KNOTS, 0.1)), [run]) == []


def rising(place):
    """A pull that begins where training ends, and is gone soon after."""
    return 0.8 * np.exp(-(((place - 0.024) / 0.002) ** 2))


@pytest.mark.long
def test_a_law_is_told_though_data_kept_back_go_beyond_it():
    many = np.linspace(0.015, 0.033, 24)
    form = FreeForm("x", "x", tuple(many.tolist()), tuple(rising(many).tolist()))
    truth = replace(machine(), free_forms=(form,))
    train, judge = record(truth, other_motion()), record(truth, rich_motion(), "judge.csv", seed=2)
    found = diagnose([train], [judge], machine(), jobs=2, without=frozenset(catalogue())).document
    (law,) = found["effects"]
    assert found["verdict"] == "unexplained"
    assert (law["location"], law["argument"]) == ("x", "x")
    assert "of the data kept back say nothing of it" in law["description"]
    assert found["heldout"]["excess_removed"] > 0.5
