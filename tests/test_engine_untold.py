"""How strong an effect may be and not be told."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from engine_kit import machine, problem, record, rich_motion

from benchmarks import untold as study
from corexy_fmi.effects import catalogue
from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.free_form import LawShape
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.model import upper_bound
from corexy_fmi.engine.naming.abreast import alone
from corexy_fmi.engine.naming.beyond import beyond
from corexy_fmi.engine.naming.plan_size import FAREST, Search
from corexy_fmi.engine.naming.screen import bounds
from corexy_fmi.engine.naming.signature import Score, changes, row_of
from corexy_fmi.engine.naming.untold import untold
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse, FreeForm

TOLD = 1.645  # standard deviations that a bound leaves
LAYOUT = bundled_layout()


def score(bound, **row):
    return Score(0.0, row, bound, row)


@cache
def nothing(name):
    """The retuned machine on a recording in which nothing is missing."""
    chosen = problem(record(machine(name), rich_motion()), machine(name))
    return minimise(chosen, np.zeros(chosen.size), 6)


def bound(name, place, nominal):
    base = nothing(nominal)
    with_it = problem(record(machine(nominal), rich_motion()), machine(nominal), [(name, place)])
    (lead,) = bounds(base, list(with_it.hypothesis.uses))
    return base, with_it, upper_bound(lead)


@pytest.mark.parametrize(
    ("name", "place", "nominal", "others"),
    [
        ("constant_force", "x", "yin2018", {}),
        ("belt_damping", "belts", "light_bench", {}),
        ("quadratic_drag", "y", "light_bench", {}),
        ("stribeck_friction", "x", "yin2018", {"speed": 0.035, "pointed": 0.0}),
        ("driver_deadband", "motors", "yin2018_dc", {"lost": 0.0}),
        ("racking", "bridge", "yin2018", {}),
    ],
)
def test_at_its_bound_an_effect_is_just_told(name, place, nominal, others):
    """Whatever the starts: what it changes beyond retuning is as large as noise lets pass."""
    base, with_it, row = bound(name, place, nominal)
    (instance,) = with_it.hypothesis.uses
    size = instance.effect.size
    value = 1 / row["upper95"] if size.scaling < 0 else row["upper95"]
    values = {p.name: p.starts[0] for p in instance.effect.parameters} | others
    u = with_it.carried(base.problem, base.u)
    start = row_of(with_it, u, instance, values | {size.name: value})
    _, gram = beyond(base).of(alone(changes(base, with_it, start[None])))
    assert 0.8 * TOLD < np.sqrt(gram[0, 0]) < 4 * TOLD


def test_starts_of_one_law_that_is_linear_say_the_same():
    force = LAYOUT.find("constant_force", "x")
    rows = [score(3.0 / abs(f), force=f) for f in force.effect.size.starts]
    assert alone(untold(force, rows)) == pytest.approx(3.0)


def test_a_size_below_which_nothing_happens_is_bounded_by_the_first_that_is_told():
    band = LAYOUT.find("driver_deadband", "motors")
    rows = [score(b, voltage=v, lost=1.0) for v, b in ((0.01, 1e9), (0.1, 40.0), (1.5, 0.02))]
    assert alone(untold(band, rows)) == 1.5
    assert alone(untold(band, rows[1:])) == 1.5
    assert alone(untold(band, rows[2:])) == pytest.approx(0.03)


def test_the_shape_that_is_told_least_counts():
    peak = LAYOUT.find("stribeck_friction", "x")
    rows = [
        score(b, static_ratio=1.8, speed=v, pointed=0.0) for v, b in ((0.004, 2.0), (0.03, 0.1))
    ]
    assert alone(untold(peak, rows)) == pytest.approx(1.6)


def test_what_is_rigid_at_infinity_is_bounded_by_its_inverse():
    bridge = LAYOUT.find("racking", "bridge")
    names = {p.name: p.starts[0] for p in bridge.effect.parameters}
    rows = [score(k / 1000, **(names | {"stiffness": k})) for k in (100.0, 1600.0, 6400.0)]
    assert alone(untold(bridge, rows)) == pytest.approx(1 / 1000)


def test_a_shape_that_retuning_hides_where_it_is_weak_is_asked_at_the_size_found():
    """A quick creep was said to be told at a ninth of what hides behind the belts' stiffness."""
    creep = LAYOUT.find("belt_relaxation", "belts")
    slow, quick = ({"ratio": 0.3, "time_constant": t} for t in (1.0, 0.01))
    rows = [score(0.1, **slow), score(0.01, **quick)]

    def again(values):
        hidden = 0.03 if values["time_constant"] > 0.1 else 0.09
        return score(hidden / values["ratio"], **values)
        yield

    assert alone(untold(creep, rows, again)) == pytest.approx(0.09)


def test_a_spring_stiffer_than_a_step_resolves_is_not_searched_for():
    """Its own numerics are told; on the printer bridges up to 1e6 N m/rad were ruled out so."""
    bridge = LAYOUT.find("racking", "bridge")
    names = {p.name: p.starts[0] for p in bridge.effect.parameters}
    rows = [score(0.1, **(names | {"stiffness": 1000.0}))]

    def again(values):
        return score(0.01, **values)
        yield

    assert alone(untold(bridge, rows, again)) == pytest.approx(1e-4)


@pytest.mark.parametrize("effect", catalogue().values(), ids=list(catalogue()))
def test_starts_are_sizes_that_change_something(effect):
    assert all(start != effect.size.neutral for start in effect.size.starts)


def test_what_retuning_hides_nearly_whole_is_bounded_by_what_it_leaves():
    """A bridge that yaws bends what retuning hides of it: three seeds were 0.41, 0.57 and 1.03."""
    base = study.retuned(study.recorded(study.nominal("stepper"), 0), "stepper")
    strength = study.bound(base, "racking", "bridge")
    use = EffectUse("racking", "bridge", study.planted(catalogue()["racking"], strength))
    truth = replace(study.nominal("stepper"), effects=(use,))
    fits = [study.retuned(study.recorded(truth, seed), "stepper") for seed in (0, 1, 2)]
    assert min(study.bound(fit, "racking", "bridge") for fit in fits) > strength


@pytest.mark.parametrize("held", ["law", "shape"])
def test_bounds_stand_on_all_that_a_fit_holds(held):
    """A law, and the share of a period that pulses fill."""
    bare, knots = machine("light_bench"), (-0.1, -0.02, 0.02, 0.1)
    drag, pulses = FreeForm("x", "vx", knots, (2.0, 0.5, -0.5, -2.0)), {"amplitude": 2.0}
    fan = EffectUse(
        "periodic_disturbance", "x", pulses | {"frequency": 3.0, "phase": 0.0, "duty": 0.3}
    )
    truth = replace(bare, **({"free_forms": (drag,)} if held == "law" else {"effects": (fan,)}))
    (use,) = problem(
        record(bare, rich_motion()), bare, [("periodic_disturbance", "x")]
    ).hypothesis.uses
    shapes = {
        "law": Hypothesis(law=LawShape("x", "vx", knots, 0.5)),
        "shape": Hypothesis((use,), shaped=True),
    }
    chosen = replace(problem(record(truth, rich_motion()), bare), hypothesis=shapes[held])
    start = np.zeros(chosen.size)
    for k, x in enumerate(chosen.unknowns):
        own = x.key.partition("@")[0].rpartition(".")[2]
        start[k] = x.internal(fan.parameters[own]) if x.key.startswith(fan.name) else 0.0
    fit, skew = minimise(chosen, start, 8), [LAYOUT.find("axis_skew", "sensor")]
    (lead,), (plain,) = bounds(fit, skew), bounds(nothing("light_bench"), skew)
    assert (lead.hypothesis.law, lead.hypothesis.shaped) == (shapes[held].law, shapes[held].shaped)
    assert 0.3 < lead.bound / plain.bound < 3


def test_the_page_shows_the_stored_numbers():
    assert study.PAGE.read_text(encoding="utf-8") == study.page()


@pytest.mark.parametrize("rate", [1.0, 0.5, 0.3])
def test_what_hardly_changes_any_more_is_searched_as_far(rate):
    """A share that goes with a power of the size: the place is found, not merely a share near."""
    search = Search(0.0, 0.2, learns=True)
    ended = (not search.goes_on(float(np.exp(rate * (search.place - 2.0)))) for _ in range(5))
    assert any(ended)
    assert search.crossing == pytest.approx(2.0, abs=0.05)


def test_where_a_share_falls_as_the_size_grows_no_rate_is_believed():
    search = Search(0.0, 0.2, learns=True)
    assert search.goes_on(2.0)
    assert search.goes_on(3.0)  # at a smaller size
    assert search.rate == 1.0
    before = search.place
    while search.goes_on(3.0):
        before = search.place
    assert search.crossing == before > -FAREST
