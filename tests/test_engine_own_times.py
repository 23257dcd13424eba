"""A law over time that begins in each recording when it does, and grows with speed as friction."""

import re
from dataclasses import replace

import numpy as np
import pytest
from engine_kit import NOISE, fitted, machine, other_motion, problem, record, rich_motion

from corexy_fmi.engine.data.samples import make_run
from corexy_fmi.engine.fitting.free_form import (
    LawShape,
    law_places,
    law_values,
    onsets,
    viscous_share,
)
from corexy_fmi.engine.fitting.noise import Noise
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.local import is_local, last_parts
from corexy_fmi.engine.judging.model import covariance, law_table, tuned_machine
from corexy_fmi.engine.judging.predict import carried
from corexy_fmi.engine.judging.reach import within_reach
from corexy_fmi.engine.naming.candidates import laws
from corexy_fmi.engine.naming.entries import ranked
from corexy_fmi.engine.naming.own_times import with_own_times
from corexy_fmi.engine.naming.smooth import along_both
from corexy_fmi.engine.places.site import Site
from corexy_fmi.engine.places.spots import best_law, with_times
from corexy_fmi.engine.telling.words import shape
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import FreeForm

KNOTS = np.linspace(-6.0, 12.0, 24)
LATE, VISCOUS = 1.2, 20.0


def fading(time):
    return 0.8 * np.exp(-np.maximum(time, 0.0) / 1.5)


def run_of(onset, motion, name, role="train", viscous=VISCOUS, axes="x"):
    """A run of a machine whose friction fades from an onset on."""
    known = tuple(KNOTS.tolist()), tuple(fading(KNOTS).tolist())
    laws = tuple(FreeForm(axis, "t", *known, "friction", viscous, onset) for axis in axes)
    recording = record(replace(machine(), free_forms=laws), motion, name, seed=len(name))
    return make_run(recording, machine(), role)


def law_fit(*runs):
    """The fit of a friction over time that all recordings have in common."""
    noise = tuple(Noise(np.zeros(0), NOISE, NOISE) for _ in runs[0].samples)
    one = problem(runs[0].recording, machine())
    law = LawShape("x", "t", tuple(np.linspace(0.0, 5.7, 8)), 0.1, acts="friction")
    many = replace(one, runs=runs, noise=(noise,) * len(runs), hypothesis=Hypothesis(law=law))
    return fitted(many, 10)


@pytest.fixture(scope="module")
def found():
    """The fit of what begins later in the second recording, as one law and with own times."""
    one = law_fit(
        run_of(0.0, rich_motion(), "first.csv"), run_of(LATE, other_motion(), "other.csv")
    )
    return one, with_own_times(one)


def test_each_recording_has_its_onset(found):
    one, own = found
    law = own.problem.hypothesis.law
    assert law.since == "first.csv"
    assert own.cost < one.cost - 30.0
    assert onsets(own, law) == pytest.approx([0.0, LATE], abs=0.15)
    assert viscous_share(own, law) == pytest.approx(VISCOUS, rel=0.5)
    assert len(law_places(own.problem.unknowns, law)) == len(law.knots)
    time = np.linspace(0.0, 4.0, 50)
    told = np.interp(time, law.knots, law_values(own, law))
    away = (told - told.mean()) - (fading(time) - fading(time).mean())  # a constant is Coulomb's
    assert np.abs(away).max() < 0.2 * np.ptp(fading(time))


def test_what_it_says_goes_into_the_machine_of_each_recording(found):
    _, own = found
    law = own.problem.hypothesis.law
    machines = [tuned_machine(own, "told", r).free_forms[0] for r in (0, 1)]
    assert [m.onset for m in machines] == onsets(own, law)
    assert all(m.viscous == viscous_share(own, law) for m in machines)
    told = law_table(own, law, covariance(own))
    assert set(told) == {"onset@other.csv", "viscous"}
    onset = told["onset@other.csv"]
    assert abs(onset["value"] - LATE) < 2 * np.ptp(onset["ci95"])  # a polygon is no exponential
    assert told["viscous"]["unit"] == "s/m"
    said = shape(own, law)
    told = r"for each m/s, by the time of first.csv, which begins at \+1\.\d\d s in other.csv$"
    assert re.search(told, said)


def test_a_recording_kept_back_is_given_its_own(found):
    _, own = found
    kept = run_of(0.6, other_motion(), "kept.csv", "holdout")
    assert within_reach(own, [kept])[0] is kept
    there = carried(own, kept, own.problem.noise[0])
    assert onsets(there, there.problem.hypothesis.law) == pytest.approx([0.6], abs=0.3)


def test_last_parts_are_judged_where_another_recording_had_that_time_of_the_law(found):
    """The first one's end is a time that no first part has; the other one's, which began later, the
    first one has had.
    """
    _, own = found
    late = last_parts(own, own, [], machine())
    assert [run.name for run in late.kept] == ["first.csv", "other.csv"]
    (other,) = within_reach(late.fit, late.kept)
    assert other.name == "other.csv"
    assert other.count == late.kept[1].count


def test_what_all_recordings_have_at_one_time_stays_so():
    runs = [(rich_motion(), "first.csv"), (other_motion(), "other.csv")]
    one = law_fit(*(run_of(0.0, motion, name, viscous=0.0) for motion, name in runs))
    assert with_own_times(one) is one


def test_a_law_of_one_recording_has_the_time_of_that():
    """So that another one may have its own."""
    one = law_fit(run_of(0.0, rich_motion(), "first.csv"))
    own = with_own_times(one)
    assert own.problem.hypothesis.law.since == "first.csv"
    assert not is_local(one)
    assert is_local(own)
    kept = run_of(LATE, other_motion(), "kept.csv", "holdout")
    there = carried(own, kept, own.problem.noise[0])
    assert onsets(there, there.problem.hypothesis.law) == pytest.approx([LATE], abs=0.3)


def test_the_other_axis_has_the_same_times():
    one = law_fit(
        run_of(0.0, rich_motion(), "first.csv", axes="xy"),
        run_of(LATE, other_motion(), "other.csv", axes="xy"),
    )
    both = along_both(with_own_times(one))
    first, second = both.problem.hypothesis.laws
    assert (first.location, second.location) == ("x", "y")
    for law in (first, second):
        assert onsets(both, law) == pytest.approx([0.0, LATE], abs=0.3)


def test_a_law_over_time_stands_in_for_one_of_something_else_that_leads():
    """One time for all recordings hid it; its place says that time is what it depends on."""
    runs = run_of(0.0, rich_motion(), "first.csv"), run_of(LATE, other_motion(), "other.csv")
    base = retune(bundled_layout(), machine(), runs)
    speed = next(law for law in laws(base.problem, base.u) if law.argument == "vy")
    wrong = best_law(base, [Hypothesis(law=speed)], map)
    competition = ranked(base, [replace(wrong, gain=20.0)])
    sites = [Site("x", 500.0, "speed", "speed", ("speed", "time"))]
    first = with_times(competition, sites, map).entries[0]
    law = first.hypothesis.law
    assert (law.location, law.argument, law.acts, law.since) == ("x", "t", "friction", "first.csv")
    assert onsets(first.fit, law)[1] == pytest.approx(LATE, abs=0.3)
    silent = [replace(sites[0], states=("speed",)), replace(sites[0], gain=5.0)]
    assert all(with_times(competition, [site], map) is competition for site in silent)
