"""Candidates that share the kernel's lanes find what each finds alone."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from engine_kit import machine, other_motion, problem, record, short_motion

from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming import abreast
from corexy_fmi.engine.naming.abreast import TOGETHER, alone, in_companies, residuals
from corexy_fmi.engine.naming.candidates import instances
from corexy_fmi.engine.naming.signature import row_of
from corexy_fmi.kernel.layout import bundled_layout

LAYOUT = bundled_layout()
NOMINALS = ("yin2018", "gt2_printer", "yin2018_dc")
EVERY = [(n, i) for n in NOMINALS for i in instances(LAYOUT, machine(n), frozenset())]
LABELS = [f"{n}-{i.effect.name}-{i.location}" for n, i in EVERY]


@cache
def bare(nominal):
    """Two recordings of a machine that misses nothing."""
    own = machine(nominal)
    first, second = (problem(record(own, m), own) for m in (short_motion(), other_motion()))
    return replace(first, runs=first.runs + second.runs, noise=first.noise + second.noise)


def asking(chosen):
    """Where the effect's file begins, and the same twice as a second question."""
    (instance,) = chosen.hypothesis.uses
    starts = {p.name: p.starts[0] for p in instance.effect.parameters}
    row = row_of(chosen, np.zeros(chosen.size), instance, starts)
    first = yield from residuals(chosen, row[None])
    second = yield from residuals(chosen, np.repeat(row[None], 2, axis=0))
    return first[0], second[1]


@cache
def together(nominal):
    """What all candidates of a machine find abreast, by instance."""
    chosen = [i for name, i in EVERY if name == nominal]
    problems = [replace(bare(nominal), hypothesis=Hypothesis((i,))) for i in chosen]
    return dict(zip(chosen, in_companies(asking, problems), strict=True))


@pytest.mark.parametrize(("nominal", "instance"), EVERY, ids=LABELS)
def test_beside_others_a_candidate_finds_what_it_finds_alone(nominal, instance):
    own = alone(asking(replace(bare(nominal), hypothesis=Hypothesis((instance,)))))
    for found, expected in zip(together(nominal)[instance], own, strict=True):
        assert found == pytest.approx(expected, abs=1e-5)  # standard deviations of the noise


@pytest.mark.parametrize("nominal", NOMINALS)
def test_candidates_share_blocks(nominal, monkeypatch):
    """Fewer calls than questions, none larger than what may run at once."""
    calls, answers = [], abreast._answers
    monkeypatch.setattr(abreast, "_answers", lambda a: calls.append(a) or answers(a))
    together.__wrapped__(nominal)
    asked = 2 * sum(name == nominal for name, _ in EVERY)
    assert sum(map(len, calls)) == asked
    assert len(calls) < asked / 3
    assert max(sum(len(sets) for _, sets in call) for call in calls) <= TOGETHER


def test_ends_come_in_the_order_of_the_company():
    """Some end at once, others after several answers."""

    def counting(times):
        for _ in range(times):
            yield from residuals(chosen, np.zeros((1, chosen.size)))
        return times

    chosen = bare("yin2018")
    assert abreast.abreast([counting(n) for n in (3, 0, 2, 1, 0)]) == [3, 0, 2, 1, 0]
