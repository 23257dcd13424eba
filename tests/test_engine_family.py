"""A winner that ends where its family does has a law in front or beside it; one inside stands."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from engine_kit import machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting.fit import minimise, settle
from corexy_fmi.engine.fitting.free_form import law_values
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.verdict import decide
from corexy_fmi.engine.naming.entries import entry_of, ranked
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.naming.search import long_fit
from corexy_fmi.engine.places.family import at_end, within_family
from corexy_fmi.engine.planning.experiment import rivals
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse, FreeForm

PLACES = tuple(np.linspace(-0.025, 0.035, 16))
ONE_SIDED = FreeForm("x", "x", PLACES, tuple(-900 * max(p - 0.003, 0.0) ** 2 for p in PLACES))
CABLE = {"stiffness": 20.0, "center": 0.005, "stiffening": 150.0}
BEYOND = FreeForm("x", "x", PLACES, tuple(-20 * p * (1 + 600 * p**2) for p in PLACES))
NOISE = {"one-sided": 5e-6, "stiffening": 5e-6, "beyond": 3e-5}  # [m]
TRUTHS = {
    "beyond": lambda: replace(machine(), free_forms=(BEYOND,)),
    "one-sided": lambda: replace(machine(), free_forms=(ONE_SIDED,)),
    "stiffening": lambda: with_effects(machine(), EffectUse("cable_drag", "x", CABLE)),
}


@cache
def competition(truth):
    """A cable at x alone beside the retuned machine."""
    noise = NOISE[truth]
    shown = record(TRUTHS[truth](), rich_motion(), noise=noise)
    base = retune(bundled_layout(), machine(), problem(shown, machine(), std=noise).runs)
    cable = Hypothesis((bundled_layout().find("cable_drag", "x"),))
    lead = screen(base, [cable], map)[0]
    ends = [long_fit(minimise(lead.problem, start, 1)) for start in lead.starts]
    return ranked(base, [entry_of(base, settle(min(ends, key=lambda f: f.cost)))])


def test_a_cable_that_fits_a_one_sided_spring_stands_behind_a_law():
    lone = competition("one-sided")
    assert at_end(lone.entries[0].fit) == ["stiffening"]
    law, cable = within_family(lone).entries
    assert law.hypothesis.law.location == law.hypothesis.law.argument == "x"
    better = cable.fit.cost - law.fit.cost
    assert law.gain == pytest.approx(cable.gain + better)
    knots, values = np.array(law.hypothesis.law.knots), law_values(law.fit)
    pulled = values - np.interp(0.0, knots, values)
    assert abs(pulled[knots < 0.003]).max() < 0.25 * abs(pulled).max()


def test_where_noise_hides_which_they_are_equals():
    lone = competition("beyond")
    assert at_end(lone.entries[0].fit) == ["stiffening"]
    found = within_family(lone)
    cable, law = found.entries
    assert cable is lone.entries[0]
    assert law.hypothesis.key == (("free_form", "x"),)
    assert law.fit.cost < cable.fit.cost
    assert law.gain == cable.gain
    assert found.probability == pytest.approx((0.5, 0.5), abs=1e-3)
    told = decide(found, None)
    assert (told.word, told.entry) == ("ambiguous", cable)
    assert told.classes == ((cable.hypothesis.key, law.hypothesis.key),)
    assert rivals(told, found) == [cable.fit, law.fit]
    once = within_family(ranked(lone.retuned, [cable, replace(law, gain=0.0)]))
    assert [e.hypothesis.key for e in once.entries] == [e.hypothesis.key for e in found.entries]


def test_a_cable_that_stiffens_stands():
    lone = competition("stiffening")
    assert within_family(lone) is lone


def test_nothing_is_asked_where_nothing_pays():
    lone = competition("one-sided")
    empty = ranked(lone.retuned, [replace(lone.entries[0], gain=-1.0)])
    assert within_family(empty) is empty
