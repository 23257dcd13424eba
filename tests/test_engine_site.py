"""Where the mismatch lies, without a name: the true entry is never asked, only simple laws are."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from engine_kit import (
    BACKLASH,
    DELAY,
    MISMATCH,
    NOISE,
    STRIBECK,
    fitted,
    machine,
    other_motion,
    problem,
    record,
    rich_motion,
    with_effects,
)

from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.free_form import LawShape
from corexy_fmi.engine.fitting.noise import white
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.doubt import misplaced, unfinished, with_curve
from corexy_fmi.engine.judging.verdict import Verdict
from corexy_fmi.engine.naming.candidates import instances
from corexy_fmi.engine.naming.entries import Competition
from corexy_fmi.engine.naming.specification import LEAST, Leftover
from corexy_fmi.engine.places import responses
from corexy_fmi.engine.places.choice import Choice
from corexy_fmi.engine.places.imposed import courses
from corexy_fmi.engine.places.probe_laws import WAVES, Motion, of_belt, play
from corexy_fmi.engine.places.probes import Probe
from corexy_fmi.engine.places.responses import moved
from corexy_fmi.engine.places.site import (
    AMISS,
    PART,
    Site,
    _probable,
    beside,
    elsewhere,
    shared,
    sites,
)
from corexy_fmi.engine.places.spots import best_law
from corexy_fmi.engine.places.view import plain
from corexy_fmi.engine.telling.document import whereabouts
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

FRAME = EffectUse("frame_mode", "frame", {"mass": 0.2, "frequency": 30.0, "damping_ratio": 0.03})
PLANTED = [
    (STRIBECK, "x", "speed"),
    (EffectUse("friction_vs_position", "y", {"extra": 0.8, "center": 0.0, "width": 0.005}), "y",
     "position"),
    (EffectUse("load_friction", "y", {"coefficient": 0.15}), "y", "load"),
    (BACKLASH, "motor1", None),
    (EffectUse("microstep_error", "motors", {"amplitude": 4e-3, "phase": 0.4}), "motors",
     "motor_angle"),
    (MISMATCH, "belts", "load"),
    (EffectUse("belt_relaxation", "belts", {"ratio": 0.2, "time_constant": 0.3}), "belts", "load"),
    (EffectUse("belt_stiffness_vs_position", "belts", {"strength": 0.3, "parallel": 1.0}), "belts",
     "load"),
    (DELAY, "sensor", "speed"),
    (EffectUse("axis_skew", "sensor", {"angle": 4e-3}), "sensor", "position"),
    (EffectUse("tool_mode", "tool", {"mass": 0.02, "frequency": 25.0, "damping_ratio": 0.05}),
     "tool", "acceleration"),
    (FRAME, "frame", "acceleration"),
    (EffectUse("racking", "bridge", {"stiffness": 60.0, "inertia": 1e-3}), "bridge", "position"),
]  # fmt: skip
DC = [
    (EffectUse("winding_lag", "motors", {"time_constant": 1e-3}), "motors", "voltage"),
    (EffectUse("torque_ripple", "motors", {"ratio": 0.2, "order": 7.0, "phase": 0.3}), "motors",
     "motor_angle"),
    (EffectUse("driver_deadband", "motors", {"voltage": 0.02}), "motors", "voltage"),
    (EffectUse("backlash", "motor1", {"gap": 5e-4, "grip": 1.0}), "motor1", "velocity_reversal"),
    (FRAME, "frame", "acceleration"),
    (EffectUse("belt_mismatch", "belts", {"ratio": 0.02}), "belts", "load"),
    (EffectUse("belt_relaxation", "belts", {"ratio": 0.2, "time_constant": 0.3}), "belts", "load"),
]  # fmt: skip


def asked(nominal, *uses, channels=("x", "y")):
    """Sites of a machine whose recording has effects that its file lacks."""
    truth = with_effects(machine(nominal), *uses)
    shown = record(truth, rich_motion(), channels=channels)
    base = retune(bundled_layout(), machine(nominal), problem(shown, machine(nominal)).runs)
    known = replace(base.problem, noise=((white(NOISE),) * len(channels),))
    return sites(Competition(minimise(known, base.u), (), (), 1.0), map)


@pytest.mark.parametrize(("use", "place", "state"), PLANTED, ids=[u.name for u, _, _ in PLANTED])
def test_simple_laws_find_the_place(use, place, state):
    found = asked("yin2018", use)
    assert found[0].location == place, found[:3]
    assert found[0].gain > 2 * LEAST
    assert state in (None, found[0].state)
    assert found[0].probability > 0.9
    assert sum(s.probability for s in found) == pytest.approx(1)


@pytest.mark.parametrize(("use", "place", "state"), DC, ids=[u.name for u, _, _ in DC])
def test_places_are_found_in_a_closed_loop(use, place, state):
    found = asked("yin2018_dc", use, channels=("x", "y", "phi1_meas", "phi2_meas"))
    assert (found[0].location, found[0].state) == (place, state), found[:3]


def test_on_the_course_that_its_motors_took_the_stage_does_the_same():
    nominal = machine("yin2018_dc")
    shown = record(nominal, rich_motion(), channels=("x", "y", "phi1_meas", "phi2_meas"))
    fit = fitted(problem(shown, nominal))
    (course,) = courses(fit)
    for name, v in zip(
        ("x", "y"), fit.problem.simulate(fit.u[None], 0, ("x", "y"))[0], strict=True
    ):
        assert course.shown[name][0] == pytest.approx(v, abs=5e-7)
    turns = np.zeros((2, 3, len(shown.time)))
    turns[0, 1:] = [[np.inf], [1e-4]]
    off, volts = course.off(turns, forced=True)  # a replay that breaks down tells nothing
    assert set(off) == {"x", "y"}
    for told in (*off.values(), *volts):
        assert np.isfinite(told).all()
        assert not told[:2].any()
    for told in (off["x"], volts[0]):
        assert told[2].any()  # and leaves those beside it alone


@pytest.mark.parametrize("fixed", [(), ("motor_torque_gain", "belt_axial_stiffness")])
def test_what_pushes_a_stage_pushes_its_motors(fixed):
    """A force on y: the response, scaled once, against the machine with that force."""
    bare = machine("yin2018_dc")
    bare = replace(bare, rel_std=bare.rel_std | dict.fromkeys(fixed, 0.0))
    push = {"amplitude": 0.02, "frequency": 1.8, "phase": 0.0}
    kit = {"noise": 0.0, "channels": ("x", "y", "phi1_meas", "phi2_meas")}
    still, moving = (
        record(with_effects(bare, *uses), rich_motion(), **kit)
        for uses in ((), (EffectUse("periodic_disturbance", "y", push),))
    )
    fit = plain(fitted(problem(still, bare), 0))
    wave = np.sin(2 * np.pi * 1.8 * still.time)
    probe = Probe("y", "time", "", ((wave, -wave),))
    (found,) = moved(fit, [probe], 1e-5, courses(fit))
    _, y, *motors = found.change.reshape(4, -1)
    told = [moving.channels[n] - still.channels[n] for n in ("y", "phi1_meas", "phi2_meas")]
    told = [t - t.mean() for t in told]
    scale = -(told[0] @ y) / (y @ y)
    for shown, change in zip(told, (y, *motors), strict=True):
        assert np.std(shown + scale * change) < 0.3 * np.std(shown)


@pytest.mark.parametrize("nominal", ["yin2018", "light_bench", "yin2018_dc"])
def test_where_nothing_is_missing_no_place_pays(nominal):
    assert all(s.gain < LEAST / 2 for s in asked(nominal))


def test_other_stages_are_not_asked():
    bare = machine("yin2018", fidelity="kinematic")
    base = retune(bundled_layout(), bare, problem(record(bare, other_motion()), bare).runs)
    assert sites(Competition(base, (), (), 1.0), map) == []


RIPPLE = EffectUse("microstep_error", "motor2", {"amplitude": 4e-3, "phase": 0.4})


@pytest.mark.parametrize("truth", [(BACKLASH,), (BACKLASH, RIPPLE)], ids=["whole", "half"])
def test_what_a_winner_leaves_is_asked_for_its_place(truth):
    """Play at motor 1 wins either way; where motor 2 is off as well, its place is found."""
    shown = record(with_effects(machine(), *truth), rich_motion())
    base = retune(bundled_layout(), machine(), problem(shown, machine()).runs)
    (play,) = [
        i
        for i in instances(base.problem.layout, machine(), frozenset())
        if (i.effect.name, i.location) == ("backlash", "motor1")
    ]
    winner = best_law(base, [Hypothesis((play,))], map)
    found = beside(Competition(base, (winner,), (1.0,), 0.0), map)
    if len(truth) == 1:
        assert all(s.gain < AMISS / 2 for s in found)
    else:
        assert (found[0].location, found[0].state) == ("motor2", "motor_angle")
        assert found[0].gain > 2 * AMISS


def test_beside_nothing_and_beside_a_law_nobody_is_asked():
    entry = SimpleNamespace(gain=500.0, hypothesis=SimpleNamespace(law=True), fit=None)
    for best in (None, entry):
        assert beside(SimpleNamespace(best=best), map) == []


def said(word, *locations, gain=100.0):
    key = [("a cause", place) for place in locations]
    uses = [SimpleNamespace(effect=SimpleNamespace(state="speed"))]
    hypothesis = SimpleNamespace(
        places=list(locations), key=key, label="a cause", law=None, uses=uses
    )
    entry = SimpleNamespace(hypothesis=hypothesis, gain=gain) if locations else None
    return Verdict(word, entry)


@pytest.mark.parametrize(
    ("verdict", "site", "word"),
    [
        (said("explained", "belts"), Site("sensor", 150.0), "unexplained"),
        (said("explained", "belts"), Site("sensor", 105.0), "explained"),  # within the threshold
        (said("explained", "belts"), Site("belts", 124.0), "explained"),  # another form there
        (said("explained", "belts"), Site("belts", 126.0), "unexplained"),
        (said("explained", "motor1"), Site("motors", 124.0), "explained"),  # holds it
        (said("explained", "pulley7"), Site("motor2", 124.0), "explained"),  # turns with it
        (said("explained", "sensor", "x"), Site("x", 109.0), "explained"),  # one of two
        (said("explained", "sensor", "x"), Site("x", 111.0), "unexplained"),
        (said("ambiguous", "tool"), Site("frame", 150.0), "unexplained"),
        (said("nothing_missing"), Site("motors", LEAST + 1), "unexplained"),
        (said("nothing_missing"), Site("motors", LEAST - 1), "nothing_missing"),
        (said("unexplained", "x"), Site("y", 500.0), "unexplained"),
    ],
)
def test_a_place_that_explains_more_refutes_a_cause_elsewhere(verdict, site, word):
    found = misplaced(verdict, [site])
    assert found.word == word
    if word != verdict.word:
        assert found.entry is None
        assert found.refuted is verdict.entry
        assert site.location in found.reason


@pytest.mark.parametrize(("place", "word"), [("belts", "explained"), ("sensor", "unexplained")])
def test_at_its_own_place_nothing_refutes_a_cause_that_leaves_nothing(place, word):
    """Linear laws may promise more there than any fit keeps."""
    assert misplaced(said("explained", "belts"), [Site(place, 150.0)], spent=True).word == word


@pytest.mark.parametrize(
    ("verdict", "gain", "floor", "word"),
    [
        (said("explained", "x"), AMISS + 1, 0.0, "unexplained"),
        (said("ambiguous", "x"), AMISS + 1, 0.0, "unexplained"),
        (said("explained", "x"), AMISS - 1, 0.0, "explained"),
        (said("explained", "x", gain=2e4), PART * 2e4 - 1, 0.0, "explained"),
        (said("explained", "x"), AMISS + 1, AMISS + 2, "explained"),  # friction's wrong shape
        (said("nothing_missing"), 500.0, 0.0, "nothing_missing"),
    ],
)
def test_a_cause_beside_which_much_is_left_is_not_the_whole(verdict, gain, floor, word):
    found = unfinished(verdict, [Site("motor2", gain, "motor_angle", "50 waves a turn")], floor)
    assert found.word == word
    assert unfinished(verdict, []) is verdict
    if word != verdict.word:
        assert (found.entry, found.refuted) == (None, verdict.entry)
        assert "motor2 (50 waves a turn)" in found.reason


@pytest.mark.parametrize(("gain", "shown"), [(60.0, True), (40.0, False)])
def test_a_refuted_cause_gives_way_to_a_law_that_explains_half_as_much(gain, shown):
    law = SimpleNamespace(gain=gain, hypothesis=SimpleNamespace(law=True))
    entries = SimpleNamespace(entries=[said("explained", "x").entry, law])
    refuted = unfinished(said("explained", "x"), [Site("y", 90.0)])
    found = with_curve(refuted, entries)
    assert found.entry is (law if shown else None)
    assert found.reason == refuted.reason
    kept = said("explained", "x")
    assert with_curve(kept, entries) is kept


def test_all_members_of_a_class_are_excused():
    verdict = said("ambiguous", "x")
    verdict = Verdict("ambiguous", verdict.entry, (((("a", "x"),), (("b", "sensor"),)),))
    assert elsewhere([Site("sensor", 900.0)], verdict.places, 100.0) is None
    assert elsewhere([Site("tool", 900.0)], verdict.places, 100.0) is not None


def test_a_law_far_better_than_all_places_keeps_its_own():
    verdict = said("unexplained", "x", gain=300.0)
    assert Verdict("unexplained", verdict.entry, sites=(Site("y", 100.0),)).site is None
    assert Verdict("unexplained", verdict.entry, sites=(Site("y", 200.0),)).site is not None


@pytest.mark.parametrize(("ahead", "place"), [(2.4, "y"), (8.0, "y"), (10.0, "sensor")])
def test_a_law_keeps_its_place_unless_another_is_surely_better(ahead, place):
    """A struck cable along y, 389 nats there, and 392 at the sensor."""
    own = Site("y", 389.0, "position", "a spring")
    found = _probable([own, Site("sensor", 389.0 + ahead, "position", "y off by y")])
    entry = said("unexplained", "y", gain=372.0).entry
    entry.hypothesis.law = object()
    assert Verdict("unexplained", entry, sites=tuple(found)).site.location == place


def test_a_section_that_grows_short_is_spanned():
    """Its share of the stretch goes with one over its length, and no line does near an end."""
    time = np.linspace(0, 10, 2000)
    place, pull = 0.15 * np.sin(time), np.sin(7 * time)
    motion = Motion(time, {"x": 0 * time, "y": place}, {}, (pull, pull), {})
    wanted = pull / (0.17 - place)
    laws = [v[0] for _, word, v in of_belt([motion], 0) if word in ("pull", "pull by position y")]
    for some, share in ((laws[:2], 0.4), (laws, 0.2)):
        found = np.linalg.lstsq(np.transpose(some), wanted, rcond=None)[0]
        left = np.std(wanted - found @ some) / np.std(wanted)
        assert (left < share) == (len(some) > 2), left


def test_play_follows_within_its_width():
    way = np.concatenate([np.linspace(0, 1, 50), np.linspace(1, 0, 50)])
    off = play(way, 0.2)
    assert off.min() == pytest.approx(-0.1)
    assert off.max() == pytest.approx(0.1)


def test_waves_reach_full_steps():
    assert {1, 2, 50, 200} <= set(WAVES)


@pytest.mark.parametrize(("share", "both"), [(0.12, False), (0.4, False), (0.5, True)])
def test_both_motors_are_told_where_the_second_has_its_share(share, both):
    """What bends and drawn parameters leave of one at the other motor is no cause there."""
    found = {name: Choice((), 5000.0) for name in ("motor1", "x")}
    found |= {"motor2": Choice(), "motors": Choice((), 5000 * (1 + share**2)), "y": Choice()}
    assert ("motors" in shared(found)) == both
    assert {"motor1", "x"} < set(shared(found))


@pytest.mark.parametrize(("gain", "place"), [(62.0, "x"), (479.0, "motor2")])
def test_what_is_left_is_told_as_the_place_where_it_is_most_of_it(gain, place):
    refuted = said("explained", "x", gain=360.0).entry
    left = Leftover(gain, 8.0, "speed of motor 2", "x")
    assert whereabouts(Verdict("unexplained", None, refuted=refuted, left=left), None)[0] == place


def test_a_place_is_told_by_what_explains_more_a_law_or_simple_ones():
    """The rest, once it is more, and a free-form law that is fitted whole, go before places."""
    law = said("unexplained", "y", gain=220.0)
    law.entry.hypothesis.law = LawShape("y", "y", (0.0,), 1.0)
    left = Leftover(90.0, 8.0, "direction of y", "y")
    for verdict, gain in ((law, 220.0), (Verdict("unexplained", None, left=left), 45.0)):
        for times, place in ((0.99, "y"), (1.01, "belts")):
            shown = replace(verdict, sites=(Site("belts", times * gain, "load"),))
            assert whereabouts(shown, None)[0] == place


def test_a_response_that_broke_down_counts_for_nothing():
    changes = np.array([[1.0, -2.0], [1e300, 0.0], [np.inf, 1.0], [np.nan, 0.0]])
    single = responses._single(changes)
    assert single.dtype == np.float32
    assert single.tolist() == [[1.0, -2.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
