"""The study of what fits reach: its draws stay within bounds, and what it plants shows."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.reach import TARGET, drawn, gains, missed, planted, visible
from corexy_fmi.engine.naming.candidates import instances
from corexy_fmi.engine.naming.spread import Spread
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import load_machine

OFFERED = Spread((1.0, 2.0), (-0.1, 0.1), (-0.1, 0.1), (10.0,), "stepper", (1e-3, 1e-2))


@pytest.mark.parametrize("machine", ["yin2018", "yin2018_dc"])
def test_draws_are_within_bounds_and_repeat(machine):
    for instance in instances(bundled_layout(), load_machine(machine)):
        values, again = (drawn(instance, OFFERED, np.random.default_rng(1)) for _ in range(2))
        assert values == again
        for p in instance.effect.parameters:
            assert p.lower <= values[p.name] <= p.upper or values[p.name] == p.default


def test_a_mismatch_of_the_belts_is_reached_from_its_start():
    machine, random = load_machine("yin2018"), np.random.default_rng(3)
    (mismatch,) = (
        i for i in instances(bundled_layout(), machine) if i.effect.name == "belt_mismatch"
    )
    values = visible(machine, mismatch, random)
    assert values is not None
    truth, found = gains(*planted(machine, mismatch, values, random))
    assert truth > TARGET / 8
    assert found == pytest.approx(truth, rel=0.05)
    assert not missed({"truth": truth, "found": found})
    assert missed({"truth": truth, "found": truth / 2})
