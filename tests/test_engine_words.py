"""What an unexplained mismatch is told to look like: its parity, its period."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from engine_kit import fitted, machine, problem, record, rich_motion, short_motion

from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.free_form import LawShape, law_errors, law_values
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.model import covariance, tuned_machine
from corexy_fmi.engine.judging.period import period
from corexy_fmi.engine.naming import again
from corexy_fmi.engine.naming.again import by_parity, refined
from corexy_fmi.engine.naming.search import rank
from corexy_fmi.machine import FreeForm

KNOTS = (-0.08, -0.03, -0.01, -0.003, 0.003, 0.01, 0.03, 0.08)
HALF = np.array([0.0, 0.3, 0.1, 0.0])
TRUTH = {
    "odd": np.r_[-HALF[::-1], HALF],
    "even": np.r_[HALF[::-1], HALF],
    "": np.r_[np.zeros(4), 2 * HALF],
}


@pytest.mark.parametrize("parity", TRUTH)
def test_a_law_is_told_to_be_odd_or_even_where_its_other_half_does_not_pay(parity):
    form = FreeForm("x", "vx", KNOTS, tuple(TRUTH[parity].tolist()))
    run = record(replace(machine(), free_forms=(form,)), rich_motion(), seed=1)
    law = Hypothesis(law=LawShape("x", "vx", KNOTS, 0.1))
    whole = fitted(replace(problem(run, machine()), hypothesis=law))
    found = by_parity(whole)
    assert found.problem.hypothesis.law.parity == parity
    # a law's straight part and its jump at zero are also nominal friction's
    error, known = law_values(found) - TRUTH[parity], np.column_stack([KNOTS, np.sign(KNOTS)])
    error = error - known @ np.linalg.lstsq(known, error, rcond=None)[0]
    spread = law_errors(found, covariance(found))
    assert np.abs(error[1:-1]).max() < 0.1
    assert (spread > 0).all()
    assert spread.max() <= law_errors(whole, covariance(whole)).max() * 1.01
    (kept,) = tuned_machine(found, "told").free_forms
    assert kept.values == pytest.approx(law_values(found))
    finer = refined(found)
    assert rank(finer) <= rank(found)
    assert finer.problem.hypothesis.law.parity == parity


@pytest.mark.parametrize(("knots", "kept"), [(12, 23), (17, 17)])
def test_a_law_is_refined_as_far_as_a_machine_holds_its_knots(knots, kept, monkeypatch):
    """One that was refined before has too many for another time."""
    run = record(machine(), short_motion())
    law = LawShape("x", "t", tuple(np.linspace(0, 1.2, knots).tolist()), 0.1)
    asked = replace(problem(run, machine()), hypothesis=Hypothesis(law=law))
    monkeypatch.setattr(again, "rank", lambda fit: -fit.problem.size)  # more knots pay
    found = refined(minimise(asked, np.zeros(asked.size), 0))
    assert len(found.problem.hypothesis.law.knots) == kept


def told(waves: float, share: float) -> str:
    """The words on a mismatch of which a wave over motor 2 holds a share."""
    random, time = np.random.default_rng(3), np.arange(0, 6, 1e-3)
    first, second = 20 * np.sin(1.3 * time), 25 * np.sin(0.9 * time)
    wave = np.sqrt(2 * share) * np.sin(waves * second + 0.4)
    error = wave + np.sqrt(1 - share) * random.normal(size=len(time))
    samples = SimpleNamespace(index=np.arange(len(time)))
    excitation = SimpleNamespace(input1=first, input2=second, mode="angles")
    run = SimpleNamespace(role="train", excitation=excitation, samples=(samples,))
    replayed = SimpleNamespace(run=run, errors=(error,))
    return period(SimpleNamespace(runs=(run,), replays={"retuned": (replayed,)}))


@pytest.mark.parametrize(
    ("waves", "length"),
    [(1, "a turn of the motor"), (50, "an electrical cycle"), (200, "a full step"),
     (16, "a tooth of a pulley of 16"), (5.5, "no known length")],
)  # fmt: skip
def test_a_period_is_matched_to_the_machine(waves, length):
    words = told(waves, 0.6)
    assert length in words
    assert "of motor 2" in words
    assert float(words.split()[3]) == pytest.approx(2 * np.pi / waves, rel=0.02)


def test_noise_and_faint_waves_have_no_period():
    assert told(16, 0.1) == ""
    assert told(16, 0.0) == ""
