"""Whole diagnoses of small cases: the four verdicts, their documents, and what must not change."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from engine_kit import (
    ASIDE,
    CASES,
    NOISE,
    STRIBECK,
    diagnosed,
    machine,
    named,
    other_motion,
    pair,
    record,
    rich_motion,
    with_effects,
)

from corexy_fmi.effects import catalogue
from corexy_fmi.engine import diagnose
from corexy_fmi.engine.diagnose import Diagnosis
from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.simulate import excitation, machine_vector
from tests.contract.documents import problems

STRUCK = frozenset({"stribeck_friction"})
OTHERS = ("nothing", "nothing,", "run-out,")
LONG = ("stribeck", "backlash, dc", "backlash, a slow tracker")
EXPLAINED = [
    pytest.param(name, marks=[pytest.mark.long] if name in LONG else [])
    for name in CASES
    if name.split()[0] not in OTHERS
]


def sound(diagnosis: Diagnosis) -> dict:
    """Its document, which must keep the contract."""
    document = {**diagnosis.document, "seconds": 1.0}
    assert problems(document) == []
    return document


@pytest.mark.parametrize("case", EXPLAINED)
def test_what_is_missing_is_named_and_placed(case):
    (use,), _, _ = CASES[case]
    document = sound(diagnosed(case))
    assert document["verdict"] == "explained"
    assert named(document) == {(use.name, use.location)}
    (effect,) = document["effects"]
    for name, value in use.parameters.items():
        found = effect["parameters"][name]
        assert found["value"] == pytest.approx(value, rel=0.25), name
    heldout = document["heldout"]
    assert heldout["rms_explained"] < heldout["rms_retuned"] <= heldout["rms_nominal"]
    assert heldout["rms_explained"] < 1.1 * heldout["noise_std"]
    assert heldout["noise_std"] == pytest.approx(NOISE, rel=0.1)
    assert heldout["weak"] is False
    coordinate = {"sensor_delay": "sensor", "belt_mismatch": "belts"}
    assert document["located"]["coordinate"] == coordinate.get(use.name, use.location)


@pytest.mark.parametrize("case", EXPLAINED)
def test_the_machine_found_holds_the_effect_and_the_retuned_numbers(case):
    (use,), name, _ = CASES[case]
    found = diagnosed(case)
    assert [(e.name, e.location) for e in found.machine.effects] == [(use.name, use.location)]
    entry = found.document["retuned"]["carriage_viscous_friction"]
    assert found.machine.parameters["carriage_viscous_friction"] == entry["value"]
    assert entry["value"] == pytest.approx(
        1.15 * machine(name).parameters["carriage_viscous_friction"], rel=0.15
    )


@pytest.mark.parametrize("case", ["nothing", "nothing, dc"])
def test_nothing_is_found_where_nothing_is_missing(case):
    document = sound(diagnosed(case))
    assert document["verdict"] == "nothing_missing"
    heldout = document["heldout"]
    assert heldout["rms_explained"] == heldout["rms_retuned"]
    assert heldout["rms_retuned"] == pytest.approx(NOISE, rel=0.05)
    assert document["located"]["coordinate"] is None
    assert diagnosed(case).machine.effects == ()


@pytest.mark.long
def test_a_struck_entry_leaves_a_law_without_a_name():
    found = diagnosed("stribeck", without=STRUCK)
    document = sound(found)
    assert document["verdict"] == "unexplained"
    (effect,) = document["effects"]
    assert (effect["name"], effect["location"]) == ("free_form", "x")
    assert "a force on x that depends on vx" in effect["description"]
    assert document["located"]["coordinate"] == "x"
    assert document["located"]["state"] == "speed"
    (law,) = found.machine.free_forms
    assert (law.location, law.argument) == ("x", "vx")
    (curve,) = found.evidence.laws
    assert (curve.lower <= curve.value).all()
    assert (curve.value <= curve.upper).all()


@pytest.mark.long
def test_near_twins_are_not_told_apart_on_weak_data():
    document = sound(diagnosed("run-out, weak"))
    assert document["verdict"] == "ambiguous"
    (group,) = document["ambiguous_between"]
    places = [(member["name"], member["location"]) for member in group]
    assert ("pulley_eccentricity", "pulley3") in places
    assert ("pulley_eccentricity", "pulley6") in places


def same(one, other) -> bool:
    """Equal bit for bit, whatever the record."""
    if isinstance(one, np.ndarray):
        return one.tobytes() == other.tobytes()
    if is_dataclass(one):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(v, other[k]) for k, v in one.items())
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other or (one != one and other != other)


@pytest.mark.long
def test_one_worker_or_two_change_no_bit():
    one, two = (diagnosed("run-out, weak", jobs) for jobs in (1, 2))
    assert same(one.document, two.document)
    assert same(one.evidence, two.evidence)
    assert same(one.machine, two.machine)


def test_sameness_can_fail():
    one = diagnosed("nothing")
    assert not same(one.document, diagnosed("nothing, dc").document)


def moved(recording):
    """Sensors set aside, belts left deflected by stiction, a few spikes."""
    layout, chosen = bundled_layout(), machine()
    shift = run_lanes(layout, excitation(chosen, recording), machine_vector(chosen, layout)[None],
                      rest=np.array([[3e-5, -2e-5, 0.0, 0.0, 0.0, 0.0]]))[0]  # fmt: skip
    still = run_lanes(layout, excitation(chosen, recording), machine_vector(chosen, layout)[None])
    changes = dict(zip(("x", "y"), shift - still[0] + np.array([[4e-4], [-7e-4]]), strict=True))
    channels = {n: recording[n] + v for n, v in changes.items()}
    channels["x"][[700, 1400, 2100]] += 2e-3
    return replace(recording, channels={**recording.channels, **channels})


def test_nuisances_are_no_physics():
    """Offsets, the initial deflection and spikes; the last part is kept back."""
    document = sound(diagnose([moved(record(machine(), rich_motion()))], [], machine()))
    assert document["verdict"] == "nothing_missing"
    assert document["heldout"]["weak"] is True
    roles = [row["role"] for row in document["fit"]]
    assert roles == ["train", "train", "holdout", "holdout"]
    for row in document["fit"]:
        assert row["rms_retuned"] == pytest.approx(NOISE, rel=0.1)
        assert row["rms_nominal"] == pytest.approx(NOISE, rel=0.1)


@pytest.mark.long
def test_coloured_noise_is_no_physics():
    random = np.random.default_rng(11)
    recordings = []
    for name, motion in (("train.csv", rich_motion()), ("judge.csv", other_motion())):
        clean = record(machine(), motion, name, noise=0.0)
        channels = dict(clean.channels)
        for axis in ("x", "y"):
            walk = np.zeros(len(clean))
            white = NOISE * random.normal(size=len(clean))
            for n in range(1, len(clean)):
                walk[n] = 0.9 * walk[n - 1] + white[n]
            channels[axis] = channels[axis] + walk
        recordings.append(replace(clean, channels=channels))
    document = sound(diagnose(recordings[:1], recordings[1:], machine(), jobs=2))
    assert document["verdict"] == "nothing_missing"


@pytest.mark.long
def test_a_swapped_recording_is_put_right_first():
    train, judge = pair(with_effects(machine(), STRIBECK, **ASIDE))
    swapped = [
        replace(r, channels={**r.channels, "x": 1e3 * r["y"], "y": 1e3 * r["x"]})
        for r in (*train, *judge)
    ]
    found = diagnose(swapped[:1], swapped[1:], machine(), jobs=2)
    assert named(found.document) == {("stribeck_friction", "x")}
    assert [finding.text for finding in found.evidence.preflight] == [
        f"{name}.csv: {text}" for name in ("train", "judge")
        for text in ("x and y in mm, expected m",
                     "x and y swapped against the command, or motor 2 turns the wrong way")
    ]  # fmt: skip


def test_spikes_in_the_data_kept_back_are_no_physics():
    (train,), (judge,) = pair(machine())
    random = np.random.default_rng(5)
    hit = random.random(len(judge)) < 0.003
    spiked = judge["x"] + 30 * NOISE * hit * random.choice([-1, 1], len(judge))
    judge = replace(judge, channels={**judge.channels, "x": spiked})
    few = frozenset(catalogue()) - {"backlash"}  # to save time
    found = diagnose([train], [judge], machine(), without=few)
    assert found.document["verdict"] == "nothing_missing"
    assert found.document["heldout"]["rms_retuned"] == pytest.approx(NOISE, rel=0.1)
