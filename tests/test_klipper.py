"""The Klipper importer: axes, gravity and the command of a described move."""

from pathlib import Path

import numpy as np
import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.recording import read_recording, write_recording
from corexy_fmi.recording.klipper import Move, import_klipper

RADIUS = 6.366e-3
GRAVITY = 9810.0
MOVE = Move((-0.025, 0.0), (0.025, 0.0), 0.1, 6.0, -0.0008)
REAL = Path(__file__).parents[2] / "shared" / "data" / "voron_ringdown"


@pytest.fixture
def klipper_file(tmp_path):
    """A perfect sensor, stage x = -z and y = +y, that feels the move starting at a time [s]."""

    def write(start=-0.0008, header="#time,accel_x,accel_y,accel_z", rows=3700):
        time = 357.8 + np.arange(rows) * 3.056e-4
        since = time - time[0] - start
        ramp = 0.1 / 6.0
        move = 0.05 / 0.1 + ramp
        felt = 6000.0 * ((since >= 0) & (since < ramp))
        felt -= 6000.0 * ((since >= move - ramp) & (since < move))
        pairs = zip(time, felt, strict=True)
        lines = [f"{t:.6f},{GRAVITY:.3f},{50.0:.3f},{-a - 20.0:.3f}" for t, a in pairs]
        path = tmp_path / "raw.csv"
        path.write_text("\n".join(["##drops=0", header, *lines]) + "\n")
        return path

    return write


def test_command_and_acceleration_belong_together(klipper_file):
    recording = import_klipper(klipper_file(), MOVE, "-z,+y", RADIUS)
    x = RADIUS * (recording["phi1"] + recording["phi2"]) / 2
    assert (x[0], x[-1]) == pytest.approx((-0.025, 0.025), abs=1e-12)
    assert recording["phi1"] == pytest.approx(recording["phi2"])
    assert recording.time[0] == 0.0
    sampled = ~np.isnan(recording["ax"])
    assert sampled.sum() == 3700
    assert recording.time[sampled][0] == pytest.approx(0.0008)
    time, ax = recording.time[sampled], recording["ax"][sampled]
    gaining = (time > 0.001) & (time < 0.016)
    assert ax[gaining] == pytest.approx(np.full(gaining.sum(), 6.0))
    commanded = x[sampled][gaining]
    assert commanded == pytest.approx(-0.025 + 3.0 * time[gaining] ** 2, abs=1e-12)


def test_gravity_and_offset_are_removed(klipper_file):
    recording = import_klipper(klipper_file(), MOVE, "-z,+y", RADIUS)
    at_rest = recording.time > 0.7
    assert recording["ax"][at_rest] == pytest.approx(np.zeros(at_rest.sum()), abs=1e-9)
    assert recording["ay"][at_rest] == pytest.approx(np.zeros(at_rest.sum()), abs=1e-9)


def test_signs_follow_the_axes(klipper_file):
    path = klipper_file()
    turned = import_klipper(path, MOVE, "z, -y", RADIUS)
    straight = import_klipper(path, MOVE, "-z,+y", RADIUS)
    assert turned["ax"] == pytest.approx(-straight["ax"], nan_ok=True)
    assert turned["ay"] == pytest.approx(-straight["ay"], nan_ok=True)


def test_a_later_start_waits(klipper_file):
    late = Move(MOVE.start, MOVE.end, MOVE.speed, MOVE.acceleration, 0.1)
    recording = import_klipper(klipper_file(0.1), late, "-z,+y", RADIUS)
    waiting = recording.time <= 0.1
    assert recording["phi1"][waiting] == pytest.approx(np.full(waiting.sum(), -0.025 / RADIUS))
    assert "clock" not in recording.metadata


def test_an_unknown_start_frees_the_clock(klipper_file, tmp_path):
    move = Move(MOVE.start, MOVE.end, MOVE.speed, MOVE.acceleration)
    recording = import_klipper(klipper_file(), move, "-z,+y", RADIUS)
    assert recording.metadata["clock"] == "free"
    write_recording(recording, tmp_path / "run.csv")
    assert read_recording(tmp_path / "run.csv").measured == ("ax", "ay")


def test_mostly_moving_files_use_the_median(klipper_file):
    recording = import_klipper(klipper_file(rows=1500), MOVE, "-z,+y", RADIUS)
    assert np.nanmedian(recording["ax"]) == pytest.approx(0, abs=1e-9)


def test_what_cannot_be_understood_is_refused(klipper_file, tmp_path):
    for axes in ("z", "z,z", "a,b", "-z,+y,x", "", "z y"):
        with pytest.raises(InputError, match="axes: found"):
            import_klipper(klipper_file(), MOVE, axes, RADIUS)
    with pytest.raises(InputError, match="line 2: found 'time;x'"):
        import_klipper(klipper_file(header="time;x"), MOVE, "x,y", RADIUS)
    with pytest.raises(InputError, match="expected a Klipper accelerometer file"):
        import_klipper(tmp_path / "none.csv", MOVE, "x,y", RADIUS)
    (tmp_path / "short.csv").write_text("#time,accel_x,accel_y,accel_z\n1,2,3,4\n")
    with pytest.raises(InputError, match="1 rows"):
        import_klipper(tmp_path / "short.csv", MOVE, "x,y", RADIUS)
    (tmp_path / "back.csv").write_text("#time,accel_x,accel_y,accel_z\n1,2,3,4\n1,2,3,4\n")
    with pytest.raises(InputError, match="line 3, column time"):
        import_klipper(tmp_path / "back.csv", MOVE, "x,y", RADIUS)


@pytest.mark.skipif(not REAL.is_dir(), reason="no real recordings beside the checkout")
@pytest.mark.parametrize(
    ("name", "start", "end", "along", "across"),
    [
        ("4_x_stock__adxl345-20200810_214044.csv", (-0.025, 0), (0.025, 0), "ax", "ay"),
        ("5_y_stock__adxl345-20200810_214047.csv", (0, -0.025), (0, 0.025), "ay", "ax"),
    ],
)
def test_a_real_printer_feels_its_move(name, start, end, along, across):
    move = Move(start, end, 0.1, 6.0, -0.0008)
    recording = import_klipper(REAL / name, move, "-z,+y", RADIUS)
    sampled = ~np.isnan(recording["ax"])
    time, felt = recording.time[sampled], recording[along][sampled]
    cruising = (time > 0.3) & (time < 0.45)
    gained = np.sum(np.diff(time) * felt[1:] * (time[1:] < 0.3))
    assert gained == pytest.approx(0.1, rel=0.15)  # the speed of the move
    assert np.abs(felt[cruising]).max() < 3.0
    assert np.nanstd(felt) > 2 * np.nanstd(recording[across])
    # the mean at rest is as good as its samples: noise 0.18 m/s^2
    assert felt[time > 0.9].mean() == pytest.approx(0.0, abs=0.03)
