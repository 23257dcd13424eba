"""Two real recordings of a printer's toolhead, and the page that reports on them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks import voron
from benchmarks.outcome import RESULTS
from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.given import make_runs
from corexy_fmi.engine.data.preflight import check
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import load_machine
from corexy_fmi.recording.klipper import Move, import_klipper
from tests.contract.documents import problems

ENDS = {"x.csv": ((-0.025, 0), (0.025, 0)), "y.csv": ((0, -0.025), (0, 0.025))}
DRIVEN = {"x.csv": "ax", "y.csv": "ay"}
real = pytest.mark.skipif(
    not voron.DATA.is_dir(), reason="the recordings of the Voron are not beside the checkout"
)


@pytest.fixture(scope="module")
def machine():
    return load_machine(voron.MACHINE)


@pytest.fixture(scope="module")
def recordings(machine):
    radius = machine.parameters["pulley_radius"]
    return {
        name: replace(
            import_klipper(
                voron.DATA / source, Move(*ENDS[name], 0.1, 6.0, -0.0008), "-z,+y", radius
            ),
            name=name,
        )
        for name, (source, _) in voron.MOVES.items()
    }


@pytest.fixture(scope="module")
def runs(machine, recordings):
    return tuple(make_runs(list(recordings.values()), [], machine)[0])


@pytest.fixture(scope="module")
def retuned(machine, runs):
    return retune(bundled_layout(), machine, runs)


def results():
    return json.loads((RESULTS / "voron.json").read_text(encoding="utf-8"))


def test_the_page_shows_the_results():
    assert voron.rendered(results()) == voron.PAGE.read_text(encoding="utf-8")


@real
def test_a_move_is_parted_before_its_stop(recordings):
    whole = recordings["x.csv"]
    first, rest = voron.parts(whole).values()
    assert first.time[-1] <= voron.CUT < whole.time[-1]
    early = whole.time <= voron.CUT
    assert np.isnan(rest["ax"][early]).all()
    late = ~early & np.isfinite(whole["ax"])
    assert np.array_equal(rest["ax"][late], whole["ax"][late])
    for part in (first, rest):
        assert np.array_equal(part["phi1"], whole["phi1"][: len(part)])


def test_what_was_foretold_names_every_effect_of_the_catalogue_that_fits():
    told = {(b["name"], b["location"]) for b in results()["foretold"]}
    assert {("belt_damping", "belts"), ("sensor_rotation", "sensor")} <= told
    assert ("winding_lag", "motors") not in told  # a stepper has none


@real
def test_the_results_are_those_of_the_recordings(recordings):
    document = results()
    for name, recording in recordings.items():
        for key, told in (("floor", voron.floors), ("crosstalk", voron.crosstalk)):
            assert told(recording) == pytest.approx(document[key][name], rel=1e-3)


@real
def test_wiring_and_units_are_sound(machine, recordings):
    for recording in recordings.values():
        same, found = check(recording, machine)
        assert found == []
        assert same is recording


@real
@pytest.mark.parametrize("name", ENDS)
def test_wrong_axes_and_units_would_be_seen(machine, recordings, name):
    recording = recordings[name]
    both = recording["ax"], recording["ay"]
    wrong = {
        "swapped": (both[1], both[0]),
        "mirrored": (-both[0], -both[1]),
        "mm/s^2": (1e3 * both[0], 1e3 * both[1]),
    }
    for word, (ax, ay) in wrong.items():
        changed = replace(recording, channels={**recording.channels, "ax": ax, "ay": ay})
        right, (finding,) = check(changed, machine)
        assert word in finding.text
        assert right[DRIVEN[name]] == pytest.approx(recording[DRIVEN[name]], nan_ok=True)


@real
def test_the_sensor_is_turned(recordings):
    along, across = (voron.crosstalk(recordings[name]) for name in ENDS)
    assert along["ax"] == pytest.approx(1.0, abs=0.1)
    assert across["ay"] == pytest.approx(1.0, abs=0.1)
    assert along["ay"] == pytest.approx(0.055, abs=0.01)
    assert across["ax"] == pytest.approx(-0.055, abs=0.01)


@real
@pytest.mark.long
def test_retuning_follows_the_first_mode_and_not_the_rest(retuned, recordings):
    for r, run in enumerate(retuned.problem.runs):
        channel = [s.channel for s in run.samples].index(DRIVEN[run.name])
        sets = np.array([np.zeros_like(retuned.u), retuned.u])
        nominal, left = retuned.problem.errors(sets, r)[channel].std(axis=1)
        floor = voron.floors(recordings[run.name])[DRIVEN[run.name]]
        assert 0.15 < floor < 0.2
        assert 2 * floor < left < 0.5 * nominal
    assert 2500 < retuned.value("belt_axial_stiffness") < 8000


@real
@pytest.mark.long
def test_retuning_goes_on_from_more_than_the_best_start(machine, recordings, monkeypatch):
    """Under white noise as small as the sensor's the starts are judged by the wrong measure."""
    whole = tuple(make_runs([recordings["y.csv"]], [recordings["y.csv"]], machine)[0])
    found = retune(bundled_layout(), machine, whole)
    monkeypatch.setattr("corexy_fmi.engine.fitting.retune.AHEAD", 1)
    assert found.cost < retune(bundled_layout(), machine, whole).cost - 5.0


@real
@pytest.mark.long
def test_no_cause_is_claimed_and_the_proof_is_called_weak(machine, recordings):
    """One move, for time; the page tells what both give."""
    diagnosis = diagnose([recordings["y.csv"]], [], machine, jobs=2)
    document = {**diagnosis.document, "seconds": 1.0}
    assert problems(document) == []
    assert document["verdict"] != "explained"
    assert document["heldout"]["weak"] is True
    assert np.isfinite(document["heldout"]["rms_retuned"])
