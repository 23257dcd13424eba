"""The excitation of Klipper's resonance test, rebuilt, and its samples as a recording."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from corexy_fmi.cli import app
from corexy_fmi.errors import InputError
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import chain, command, rest
from corexy_fmi.recording import read_recording
from corexy_fmi.recording.resonance import import_resonance
from corexy_fmi.resonance import NEW, OLD, changed, frequencies, swept_motion
from corexy_fmi.simulate import simulate

SHORT = {"first": 20.0, "last": 60.0, "rate": 10.0}
RADIUS = load_machine("gt2_printer").parameters["pulley_radius"]


def course(test, rows=400_001):
    motion = swept_motion(test, (1, 0), (0, 0))
    time = np.linspace(0, motion.duration, rows)
    place = motion.position(time)[:, 0]
    return time, place, np.gradient(place, time)


def test_the_old_test_swings_about_its_start():
    test = changed(OLD, SHORT)
    _, place, speed = course(test)
    stroke = test.per_hertz / (32 * test.first)
    assert (place.max(), place.min()) == pytest.approx((stroke, -stroke), rel=0.05)
    assert np.abs(speed).max() == pytest.approx(test.per_hertz / 4, rel=1e-3)
    assert place[-1] == pytest.approx(0, abs=1e-12)
    assert speed[-1] == pytest.approx(0, abs=1e-4)


def test_the_new_test_swings_to_one_side_on_a_slow_triangle():
    pure = replace(changed(NEW, SHORT), period=0.0)
    _, place, _ = course(pure)
    assert place.min() == pytest.approx(0, abs=1e-12)
    assert place.max() == pytest.approx(pure.per_hertz / (16 * pure.first), rel=1e-3)
    time, place, speed = course(changed(NEW, SHORT))
    assert np.abs(speed).max() == pytest.approx(0.12 + NEW.per_hertz / 4, rel=0.02)
    assert np.ptp(place) == pytest.approx(0.4 * 0.6**2 / 4, rel=0.03)  # a P^2 / 16, 36 mm
    assert speed[-1] == pytest.approx(0, abs=1e-3)
    assert time[-1] > 4.0


@pytest.mark.parametrize("test", [OLD, NEW])
def test_the_frequency_rises_evenly(test):
    f = frequencies(test)
    ends = np.cumsum(0.5 / f)
    assert (f[1:] - f[0]) / ends[:-1] == pytest.approx(np.full(len(f) - 1, test.rate))
    assert f[-1] <= test.last < f[-1] + test.rate / f[-1]


@pytest.fixture(scope="module")
def raw(tmp_path_factory):
    """What a sensor x = -z, y = y would write of a printer in the test, 0.5 s before its start."""
    machine = load_machine("gt2_printer")
    test = changed(OLD, SHORT)
    motion = chain(rest((0.01, 0.0), 0.5), swept_motion(test, (1, 0), (0.01, 0)))
    felt = simulate(machine, command(motion, RADIUS, 3200.0))
    time = np.arange(0, motion.duration, 1 / 3200)
    ax, ay = (np.interp(time, felt.time, felt[n]) for n in ("ax", "ay"))
    noise = np.random.default_rng(4).normal(0, 0.2, (3, len(time)))
    columns = 1e3 * np.array([noise[0] + 9.81, ay + noise[1], noise[2] - ax])
    path = tmp_path_factory.mktemp("raw") / "raw_data_x.csv"
    rows = np.column_stack([77.0 + time, *columns])
    head = "#time,accel_x,accel_y,accel_z"
    np.savetxt(path, rows, fmt="%.6f", delimiter=",", header=head, comments="")
    return path


def test_the_first_pulse_is_found(raw):
    found = import_resonance(raw, changed(OLD, SHORT), (1, 0), (0.01, 0), "-z,+y", RADIUS)
    begin = float(found.metadata["first_pulse"].split()[0])
    assert begin == pytest.approx(0.5, abs=5e-3)  # a stage lags behind its command
    assert found.metadata["clock"] == "free"
    x = RADIUS * (found["phi1"] + found["phi2"]) / 2
    assert (x[0], np.ptp(x)) == pytest.approx((0.01, 2 * 0.075 / 32 / 20), rel=0.05)
    seen = np.isfinite(found["ax"])
    assert abs(found["ax"][seen & (found.time < 0.4)].mean()) < 0.05


def test_a_told_offset_is_taken_as_it_is(raw):
    test = changed(OLD, SHORT)
    found = import_resonance(raw, test, (1, 0), (0.01, 0), "-z,+y", RADIUS, 0.5)
    assert "clock" not in found.metadata
    still = found.time < 0.5
    assert np.ptp(found["phi1"][still]) == 0
    assert np.ptp(found["phi1"][found.time < 0.52]) > 0


def test_another_axis_shows_none_of_it(raw):
    with pytest.raises(InputError, match="resemble each other by"):
        import_resonance(raw, changed(OLD, SHORT), (0, 1), (0.01, 0), "x,y", RADIUS)


def test_the_command(raw, tmp_path):
    out = tmp_path / "sweep.csv"
    words = ["import", "resonance", str(raw), "--axis", "x", "--at", "0.13,0.12", "--centre",
             "0.12,0.12", "--old", "--min-freq", "20", "--max-freq", "60", "--hz-per-sec", "10",
             "--axes=-z,+y", "--machine", "gt2_printer", "--out"]  # fmt: skip
    done = CliRunner().invoke(app, [*words, str(out)])
    assert done.exit_code == 0, done.output
    assert "first pulse 0.5" in done.output
    assert read_recording(out).measured == ("ax", "ay")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--axis", "z"], "axis: found 'z'"),
        (["--axis", "0,0"], "axis: found '0,0'"),
        (["--axis", "x", "--max-freq", "4"], "last: found 4.0 Hz, expected more than 5"),
        (["--axis", "x", "--accel-per-hz", "-1"], "per_hertz: found -1.0"),
    ],
)
def test_mistakes_are_told(raw, tmp_path, words, told):
    rest_ = ["--at", "0,0", "--machine", "gt2_printer", "--out", str(tmp_path / "o.csv")]
    done = CliRunner().invoke(app, ["import", "resonance", str(raw), *words, *rest_])
    assert isinstance(done.exception, InputError)
    assert told in str(done.exception)


def test_a_spectrum_is_refused(tmp_path):
    path = tmp_path / "resonances_x.csv"
    path.write_text("freq,psd_x,psd_y,psd_z,psd_xyz\n5.0,1,1,1,3\n")
    with pytest.raises(InputError, match=r"line 1: a spectrum, .*OUTPUT=raw_data"):
        import_resonance(path, OLD, (1, 0), (0, 0), "x,y", RADIUS)
