"""Known changes hidden in real recordings: the edits, how they are judged, the page."""

import hashlib
import json

import numpy as np
import pytest

from benchmarks import hidden
from benchmarks.concealed.cases import seed_of
from benchmarks.hidden_edits import EDITS, truth_of
from benchmarks.hidden_edits import hidden as hide
from benchmarks.hidden_page import outcome, rendered, rows
from corexy_fmi.recording import Recording

TIME = np.arange(0, 2, 1e-3)


@pytest.fixture
def recording():
    wave, noise = np.sin(20 * TIME), np.random.default_rng(3).normal(0, 0.01, (2, len(TIME)))
    channels = {"phi1": TIME.copy(), "phi2": TIME.copy(), "ax": wave + noise[0], "ay": noise[1]}
    channels["ax"][7] = channels["ay"][7] = np.nan  # a row that was not sampled
    return Recording("r.csv", TIME, channels)


def edited(recording, name, size):
    return hide(recording, {"edit": name, "size": size, "seed": 5})


def test_samples_come_late_with_their_noise(recording):
    late = edited(recording, "late samples", 5e-3)
    seen = np.isfinite(recording["ax"])
    assert np.array_equal(late["ax"][seen][5:], recording["ax"][seen][:-5])
    assert np.isnan(late["ax"][7])
    assert late["phi1"] is recording["phi1"]


def test_a_sensor_turned_and_scaled(recording):
    turned = edited(recording, "turned sensor", 0.2)
    assert turned["ax"] == pytest.approx(recording["ax"] - 0.2 * recording["ay"], nan_ok=True)
    assert turned["ay"] == pytest.approx(recording["ay"] + 0.2 * recording["ax"], nan_ok=True)
    assert edited(recording, "scaled x", 1.2)["ax"] == pytest.approx(
        1.2 * recording["ax"], nan_ok=True
    )


def test_a_clock_that_is_slow(recording):
    clean = Recording("r.csv", TIME, {"phi1": TIME, "ax": np.sin(20 * TIME)})
    early = TIME < 1.9
    fast = edited(clean, "stretched clock", 0.02)["ax"][early]
    assert fast == pytest.approx(np.sin(20 * 1.02 * TIME[early]), abs=1e-3)


def test_a_shaper_takes_its_frequency_away():
    f, zeta = 40.0, 0.1
    fall = np.exp(-zeta * 2 * np.pi * f * TIME) * np.sin(
        2 * np.pi * f * np.sqrt(1 - zeta**2) * TIME
    )
    ring = Recording("r.csv", TIME, {"phi1": TIME, "ax": fall})
    left = edited(ring, "shaper", f)["ax"][TIME > 0.02]
    assert np.abs(left).max() < 0.01 * np.abs(fall).max()


def test_a_sham_adds_noise_alone(recording):
    noisy = edited(recording, "sham 1", 0.0)
    change = noisy["ax"] - recording["ax"]
    assert 0.1 * 0.01 < np.nanstd(change) < 0.01
    assert abs(np.nanmean(change)) < 0.001


def case(edit, effects, effect="sensor_delay", verdict="explained", nearest=()):
    named = [{"name": n, "location": p, "parameters": {}} for n, p in effects]
    near = [{"gain_share": 1.0, "effects": [{"name": n, "location": p, "parameters": {}}
             for n, p in nearest]}] if nearest else []  # fmt: skip
    told = {"verdict": verdict, "effects": named, "nearest": near}
    return {"host": "h", "edit": edit, "truth": {"effect": effect, "edit": edit}, "told": told}


PULSES, DELAY, OTHER = ("periodic", "x"), ("sensor_delay", "sensor"), ("tool_mode", "tool")
BEFORE = case("untouched", [PULSES], "")


@pytest.mark.parametrize(
    ("after", "expected"),
    [
        (case("late samples", [PULSES, DELAY]), "hit"),
        (case("late samples", [DELAY]), "seen"),
        (case("late samples", [PULSES]), "missed"),
        (case("late samples", [OTHER]), "wrong"),
        (case("late samples", [OTHER], verdict="ambiguous"), "missed"),
        (case("late samples", [("free_form", "x")], verdict="unexplained",
              nearest=[PULSES, DELAY]), "hit"),
        (case("sham 1", [PULSES], ""), "unchanged"),
        (case("sham 1", [OTHER], ""), "false alarm"),
        (case("sham 1", [], "", "nothing_missing"), "false alarm"),
        (case("shaper", [OTHER], ""), "wrong"),
        (case("shaper", [OTHER], "", "ambiguous"), "open"),
        (case("shaper", [PULSES], ""), "missed"),
    ],
)  # fmt: skip
def test_how_a_case_is_judged(after, expected):
    assert outcome(after, BEFORE) == expected


def test_another_member_of_an_ambiguous_class_is_no_false_alarm():
    before = case("untouched", [PULSES], "", "ambiguous")
    member = [{"name": n, "location": p} for n, p in (OTHER, DELAY)]
    before["told"]["ambiguous_between"] = [[{"name": "periodic", "location": "x"}, member]]
    assert outcome(case("sham 1", [OTHER, DELAY], "", "ambiguous"), before) == "same class"
    assert outcome(case("sham 1", [OTHER, DELAY], "", "explained"), before) == "false alarm"
    assert outcome(case("sham 1", [OTHER], "", "ambiguous"), before) == "false alarm"


def test_a_seal_holds_its_truth():
    truth = truth_of(EDITS["late samples"], 12, None)
    mark, sealed = hidden.seal(truth)
    assert hashlib.sha256(sealed).hexdigest() == mark
    assert json.loads(sealed[32:]) == truth
    assert hidden.seal(truth)[0] != mark  # salted


def test_every_stored_case_was_sealed_before_and_drawn_by_its_seed():
    text = hidden.STORE.read_text(encoding="utf-8")
    seals = set()
    for entry in map(json.loads, text.splitlines()):
        if "told" not in entry:
            seals.add(entry["seal"])
        elif entry["truth"]:
            assert entry["seal"] in seals
            host = next(h for h in hidden.HOSTS if h.name == entry["host"])
            seed = seed_of(hidden.ORIGIN, f"{host.name}:{entry['edit']}")
            drawn = truth_of(EDITS[entry["edit"]], seed, host.spans.get(entry["edit"]))
            assert entry["truth"] == drawn


def test_the_page_shows_the_stored_cases():
    assert hidden.PAGE.read_text(encoding="utf-8") == rendered(hidden.stored())
    for turn in {case["round"] for case in hidden.stored()}:
        cases = [case for case in hidden.stored() if case["round"] == turn]
        assert len(rows(cases)) == len(cases)
