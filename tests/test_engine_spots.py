"""A spot on an axis, narrower than the knots of a law: found by its place, fitted, else nothing."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from engine_kit import machine, other_motion, problem, record, rich_motion, short_motion

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.fitting.free_form import LawShape, law_values
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.model import tuned_machine
from corexy_fmi.engine.naming.again import refined
from corexy_fmi.engine.naming.candidates import laws
from corexy_fmi.engine.naming.entries import Competition
from corexy_fmi.engine.naming.smooth import commoner
from corexy_fmi.engine.places.probe_laws import FINE
from corexy_fmi.engine.places.site import Site, sites
from corexy_fmi.engine.places.spots import ACROSS, _windows, best_law, with_spot
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import FreeForm
from corexy_fmi.motion import chain, line, rest

SPOT, HALF = 0.0112, 2e-3  # [m] of y: its middle, from there to either end
BUMP = FreeForm("y", "y", (SPOT - HALF, SPOT - HALF / 2, SPOT + HALF / 2, SPOT + HALF),
                (0.0, -0.8, 0.8, 0.0))  # fmt: skip


@cache
def base(bumpy):
    """The retuned machine on a recording, with a magnet beside the rail or without."""
    truth = replace(machine(), free_forms=(BUMP,) if bumpy else ())
    shown = record(truth, rich_motion(), noise=5e-6)
    return retune(bundled_layout(), machine(), problem(shown, machine(), std=5e-6).runs)


TIGHT = FreeForm("y", "y", (SPOT - HALF, SPOT, SPOT + HALF), (0.0, 1.2, 0.0), "friction")
HUMPS = FreeForm("y", "y", (-0.012, -0.008, -0.004, 0.002, 0.006, 0.01),
                 (0.0, 0.5, 0.1, 0.1, 0.8, 0.0), "friction")  # fmt: skip


def test_a_friction_of_any_shape_along_the_rail_is_a_law_of_its_own():
    """Two humps of unequal height, which no catalogued spot has."""
    shown = record(replace(machine(), free_forms=(HUMPS,)), rich_motion(), noise=5e-6)
    fit = retune(bundled_layout(), machine(), problem(shown, machine(), std=5e-6).runs)
    asked = [Hypothesis(law=law) for law in laws(fit.problem, fit.u)]
    assert {(h.law.location, h.law.argument) for h in asked if h.law.acts == "friction"} == {
        (axis, of) for axis in "xy" for of in (axis, "t")
    }
    found = best_law(fit, asked, map)
    law = found.fit.problem.hypothesis.law
    assert (law.acts, law.location, law.argument) == ("friction", "y", "y")
    finer = refined(found.fit)
    places = np.linspace(-0.012, 0.01, 100)
    there = np.interp(places, finer.problem.hypothesis.law.knots, law_values(finer))
    truth = np.interp(places, HUMPS.knots, HUMPS.values)
    assert np.std(there - truth) < 0.3 * np.std(truth)  # a constant one is the rail's
    (kept,) = tuned_machine(finer, "found").free_forms
    assert kept.acts == "friction"


@pytest.mark.long
def test_a_rail_that_is_tight_in_two_places_is_no_one_spot():
    """A single spot leaves something over; the law holds it, on another path too."""
    truth = replace(machine(), free_forms=(HUMPS,))
    train = [record(truth, rich_motion(), noise=5e-6, seed=n) for n in (1, 2)]
    kept = record(truth, other_motion(), noise=5e-6, seed=3)
    found = diagnose(train, [kept], machine(), jobs=2)
    document = found.document
    assert document["verdict"] == "unexplained"
    (effect,) = document["effects"]
    assert [effect[k] for k in ("location", "argument", "acts")] == ["y", "y", "friction"]
    assert effect["description"].startswith("a Coulomb friction of y that depends on y")
    assert document["nearest"][0]["effects"][0]["name"] == "friction_vs_position"
    assert document["heldout"]["rms_retuned"] > 2 * 5e-6
    assert document["heldout"]["rms_explained"] == pytest.approx(5e-6, rel=0.1)
    (curve,) = found.evidence.laws
    assert curve.acts == "friction"


def alone(fit):
    """A competition that nothing has entered."""
    return Competition(fit, (), (), 1.0)


def test_a_spot_is_found_at_its_place_and_fitted():
    found = sites(alone(base(True)), map)
    assert found[0].location == "y"
    assert found[0].state == "position"
    assert found[0].word in ("y near 10 mm", "y near 11 mm", "y near 12 mm")
    first = with_spot(alone(base(True)), found, map).entries[0]
    law, values = first.hypothesis.law, law_values(first.fit)
    assert (law.location, law.argument) == ("y", "y")
    assert first.gain > found[0].gain
    at = SPOT + np.array([-HALF / 2, HALF / 2])
    assert np.diff(np.interp(at, law.knots, values))[0] == pytest.approx(1.6, rel=0.25)


def test_a_tight_spot_that_is_passed_both_ways_is_found_and_fitted():
    """Its force turns with the motion, so that no pull there is alike."""
    shown = record(replace(machine(), free_forms=(TIGHT,)), rich_motion(), noise=5e-6)
    fit = retune(bundled_layout(), machine(), problem(shown, machine(), std=5e-6).runs)
    (site, *_) = sites(alone(fit), map)
    assert site.location == "y"
    assert "position" in site.states
    beside = replace(site, state="time")  # whatever explains most, a spot among it is looked at
    first = with_spot(alone(fit), [beside], map).entries[0]
    law, values = first.hypothesis.law, law_values(first.fit)
    assert (law.acts, law.location, law.argument) == ("friction", "y", "y")
    there, away = np.interp([SPOT, SPOT - 2 * HALF], law.knots, values)
    assert there - away == pytest.approx(1.2, rel=0.3)


def law_of(motion, acts, free_form):
    """The fit of a law along y of one kind to a recording of a machine with another or the same."""
    shown = record(replace(machine(), free_forms=(free_form,)), motion, noise=5e-6)
    fit = retune(bundled_layout(), machine(), problem(shown, machine(), std=5e-6).runs)
    asked = [h for h in (Hypothesis(law=law) for law in laws(fit.problem, fit.u))
             if (h.law.location, h.law.argument, h.law.acts) == ("y", "y", acts)]  # fmt: skip
    return best_law(fit, asked, map).fit


ONE_WAY = chain(rest((0, -0.02), 0.2), line((0, -0.02), (0, 0.03), 0.05, 2.0), rest((0, 0.03), 0.2))
WIDE = FreeForm("y", "y", (-0.012, 0.0, 0.012), (0.0, 1.2, 0.0), "friction")


def test_what_was_passed_one_way_alone_is_taken_for_friction():
    fit = law_of(ONE_WAY, "force", WIDE)
    found = commoner(fit)
    law = found.problem.hypothesis.law
    assert law.acts == "friction"
    assert found.cost == pytest.approx(fit.cost, abs=3.0)
    there, away = np.interp([0.0, 0.02], law.knots, law_values(found))
    assert there - away == pytest.approx(1.2, rel=0.3)


@pytest.mark.parametrize("acts", ["force", "friction"])
def test_what_was_passed_both_ways_is_what_it_is(acts):
    fit = law_of(rich_motion(), acts, replace(WIDE, acts=acts))
    assert commoner(fit) is fit


def test_without_one_nothing_is_added():
    fit = base(False)
    found = sites(alone(fit), map)
    assert all(s.gain < 10 for s in found)
    assert with_spot(alone(fit), found, map).entries == ()


@pytest.mark.parametrize(
    "site",
    [Site("motor1", 500.0, "position"), Site("y", 500.0, "speed"), Site("y", 9.0, "position")],
)
def test_only_a_place_on_an_axis_that_pays_is_looked_at(site):
    shown = record(machine(), short_motion())
    given = alone(retune(bundled_layout(), machine(), problem(shown, machine()).runs))
    assert with_spot(given, [site], map) is given


def test_windows_cover_the_axis():
    found = _windows(LawShape("y", "y", (-0.1, 0.1), 1.0, acts="friction"))
    assert {w.acts for w in found} == {"friction"}
    step = 0.2 / (FINE - 1)
    assert all(np.allclose(np.diff(w.knots), step) and len(w.knots) == ACROSS for w in found)
    places = np.linspace(-0.1, 0.1, 200)
    reach = [max(min(p - w.knots[1], w.knots[-2] - p) for w in found) for p in places]
    assert min(reach) > step  # every spot lies well inside of one of them
