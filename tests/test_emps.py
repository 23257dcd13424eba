"""A real axis whose force pulses others logged, and the page that reports on it."""

import json

import numpy as np
import pytest
from scipy.io import loadmat

from benchmarks import emps
from benchmarks.outcome import RESULTS
from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.given import make_runs
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.naming.candidates import hypotheses
from corexy_fmi.engine.naming.edges import edges
from corexy_fmi.engine.naming.pulses import pulse_fits, train
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import load_machine
from corexy_fmi.recording.columns import import_columns
from corexy_fmi.simulate import simulate

real = pytest.mark.skipif(not emps.DATA.is_dir(), reason="EMPS is not beside the checkout")


def recording(name):
    return import_columns(emps.DATA / f"{name}.mat", emps.CLOSED, dict(emps.ABOUT), 1.0)


def base(name):
    run, machine = recording(name), load_machine("emps")
    runs, _ = make_runs([run], [run], machine)
    return retune(bundled_layout(), machine, tuple(runs))


@real
def test_the_published_numbers_hold_in_closed_loop():
    """Published: 3.8 um without the offset, 3.0 um with it; the loop's own details differ."""
    run = recording("DATA_EMPS")
    error = run["x"] - simulate(load_machine("emps"), run)["x"]
    assert 3e-6 < np.sqrt(np.mean(error**2)) < 5e-6
    assert 1.5e-6 < error.mean() < 3e-6  # 3.16 N over g kp


@pytest.mark.long
@real
def test_the_pulses_are_found_where_they_were_logged():
    logged = loadmat(emps.DATA / "DATA_EMPS_PULSES.mat")
    on = logged["pulses_N"].ravel() > 0
    edge = logged["t"].ravel()[1:][np.diff(on.astype(int)) != 0]
    fit = base("DATA_EMPS_PULSES")
    found = np.array([e.time for e in edges(fit, 0, "x")])
    assert all(np.abs(edge - t).min() < 0.02 for t in found)
    assert all(np.abs(found - t).min() < 0.02 for t in edge)
    (pulses,) = pulse_fits(fit, hypotheses(fit.problem, fit.u), map)
    force = 1.01 * 5 * float(logged["gtau"].item())
    assert pulses.value("periodic_disturbance.x.amplitude") == pytest.approx(force, rel=0.1)


@pytest.mark.long
@real
def test_the_diagnosis_names_the_pulses_alone():
    """The untouched recording first, whose nearest set is the machine of the other."""
    document = diagnose([recording("DATA_EMPS")], [], load_machine("emps"), jobs=2).document
    assert document["verdict"] == "unexplained"
    machine = emps.fitted(document)
    assert machine.parameters["coulomb_friction"] == pytest.approx(20.39, rel=0.1)
    document = diagnose([recording("DATA_EMPS_PULSES")], [], machine, jobs=2).document
    assert document["verdict"] == "explained"
    (effect,) = document["effects"]
    assert (effect["name"], effect["location"]) == ("periodic_disturbance", "x")
    force = 1.01 * 5 * float(loadmat(emps.DATA / "DATA_EMPS_PULSES.mat")["gtau"].item())
    assert effect["parameters"]["amplitude"]["value"] == pytest.approx(force, rel=0.02)


@real
def test_there_are_none_in_the_untouched_recording():
    found = edges(base("DATA_EMPS"), 0, "x")
    assert found == []
    assert train(found) is None


def test_the_page_shows_the_stored_numbers():
    document = json.loads((RESULTS / "emps.json").read_text(encoding="utf-8"))
    assert emps.rendered(document) == emps.PAGE.read_text(encoding="utf-8")


def test_the_stored_numbers_pass():
    document = json.loads((RESULTS / "emps.json").read_text(encoding="utf-8"))
    pulses = document["pulses"]
    assert pulses["edge_error_max"] < 0.02
    assert pulses["windows_found"] == pulses["windows_logged"]
    assert pulses["waveform_error"] < 0.1
    names = [e["name"] for e in document["runs"]["DATA_EMPS"]["effects"]]
    assert "periodic_disturbance" not in names
