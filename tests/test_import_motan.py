"""Captures of Klipper's motion analysis: moves and accelerometer on one clock."""

import gzip
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from corexy_fmi.cli import app
from corexy_fmi.errors import InputError
from corexy_fmi.recording import read_recording
from corexy_fmi.recording.motan import import_motan

RADIUS = 6.366e-3
ACCEL, SPEED, BEGIN = 3000.0, 100.0, 12.0  # mm/s^2, mm/s, s
RAMP = SPEED / ACCEL


def trapq(start, way, begin):
    """The three moves of a trapezoid over 50 mm."""
    place, time, moves = np.array([*start, 5.0]), begin, []
    length = 50 - SPEED * RAMP
    for duration, speed, accel in ((RAMP, 0.0, ACCEL), (length / SPEED, SPEED, 0.0),
                                   (RAMP, SPEED, -ACCEL)):  # fmt: skip
        moves.append([time, duration, speed, accel, place.tolist(), [*way, 0.0]])
        place = place + (speed + accel * duration / 2) * duration * np.array([*way, 0.0])
        time += duration
    return moves


@pytest.fixture
def capture(tmp_path):
    """Write a capture; a sensor that feels the commands exactly, from 10 s on."""

    def write(sensors=("adxl345:adxl345",), settings=None, packed=True, cut=0, begin=BEGIN):
        out, back = trapq((100, 125), (1.0, 0.0), begin), trapq((150, 125), (-1.0, 0.0), begin + 2)
        messages = [{"id": "status", "result": {"status": {"configfile": {"settings":
                    settings or {}}}}}, {"q": "trapq:extruder", "params": {"data": [[1]]}},
                    {"q": "trapq:toolhead", "params": {"data": out}},
                    {"q": "trapq:toolhead", "params": {"data": [out[-1], *back]}}]  # fmt: skip
        time = np.arange(10.0, 16.0, 1 / 3200)
        felt = np.zeros(len(time))
        for start, duration, _, accel, _, way in out + back:
            felt += accel * way[0] * ((time >= start) & (time < start + duration))
        for name in sensors:
            for part in np.array_split(np.arange(len(time)), 5):
                rows = np.column_stack([time, felt + 30, 0 * felt, 0 * felt + 9810])[part]
                messages.append({"q": name, "params": {"data": rows.tolist()}})
        text = b"".join(json.dumps(m).encode() + b"\x03" for m in messages)
        text = text[: len(text) - cut]
        path = tmp_path / "log.json.gz"
        path.write_bytes(gzip.compress(text) if packed else text)
        return path

    return write


@pytest.mark.parametrize("packed", [True, False])
def test_commands_and_samples_are_on_one_clock(capture, packed):
    found = import_motan(capture(packed=packed), "x,y", (0.125, 0.125), RADIUS)
    assert "clock" not in found.metadata
    x = RADIUS * (found["phi1"] + found["phi2"]) / 2
    assert x[0] == pytest.approx(-0.025)
    assert x.max() == pytest.approx(0.025)
    assert x[-1] == pytest.approx(-0.025)
    seen = np.isfinite(found["ax"])
    time, ax = found.time[seen], found["ax"][seen]
    begin = 0.5  # half a second of rest is kept
    gaining = (time > begin + 1e-3) & (time < begin + RAMP - 1e-3)
    assert ax[gaining] == pytest.approx(np.full(gaining.sum(), 3.0))
    assert x[seen][gaining] == pytest.approx(-0.025 + 1.5 * (time[gaining] - begin) ** 2)
    assert ax[time < begin - 1e-3] == pytest.approx(0)  # the mean at rest is gone


def test_a_span_and_its_limits(capture):
    path = capture()
    part = import_motan(path, "x,y", (0.125, 0.125), RADIUS, span=(3.0, 6.0))
    assert part.time[-1] == pytest.approx(3.0 - 0.5, abs=1e-3)
    assert RADIUS * part["phi1"][0] == pytest.approx(0.025)
    with pytest.raises(InputError, match="a move is under way"):
        import_motan(path, "x,y", (0.125, 0.125), RADIUS, span=(2.1, 5.0))
    with pytest.raises(InputError, match="no move while samples"):
        import_motan(path, "x,y", (0.125, 0.125), RADIUS, span=(5.0, 6.0))


def test_a_shaper_is_mentioned(capture, tmp_path):
    path, out = capture(settings={"input_shaper": {"shaper_freq_x": 55.0}}), tmp_path / "run.csv"
    words = ["import", "motan", str(path), "--centre", "0.125,0.125", "--machine", "gt2_printer"]
    done = CliRunner().invoke(app, [*words, "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "input shaping is configured" in done.output
    assert read_recording(out).measured == ("ax", "ay")


def test_several_sensors_need_a_name(capture):
    path = capture(sensors=("adxl345:head", "lis2dw:bed"))
    with pytest.raises(InputError, match=r"several accelerometers \(head, bed\)"):
        import_motan(path, "x,y", (0, 0), RADIUS)
    with pytest.raises(InputError, match="no accelerometer 'hed', found head, bed"):
        import_motan(path, "x,y", (0, 0), RADIUS, "hed")
    assert "head" in import_motan(path, "x,y", (0, 0), RADIUS, "head").metadata["source"]


def test_what_is_no_capture(capture, tmp_path):
    with pytest.raises(InputError, match="no accelerometer's samples"):
        import_motan(capture(sensors=()), "x,y", (0, 0), RADIUS)
    (tmp_path / "a.json").write_text("time,x\n1,2\n")
    with pytest.raises(InputError, match="message 1: not JSON"):
        import_motan(tmp_path / "a.json", "x,y", (0, 0), RADIUS)
    (tmp_path / "b.json").write_text('{"q": "trapq:toolhead", "params": {"data": [[1, 2]]}}\x03')
    with pytest.raises(InputError, match="no data of trapq toolhead"):
        import_motan(tmp_path / "b.json", "x,y", (0, 0), RADIUS)
    (tmp_path / "c.json").write_text('{"id": "info"}\x03')
    with pytest.raises(InputError, match="no moves of the toolhead"):
        import_motan(tmp_path / "c.json", "x,y", (0, 0), RADIUS)
    with pytest.raises(InputError, match="expected a capture"):
        import_motan(tmp_path / "none.json.gz", "x,y", (0, 0), RADIUS)


def test_a_log_that_was_cut_off_counts_up_to_there(capture):
    assert len(import_motan(capture(cut=3), "x,y", (0.125, 0.125), RADIUS)) > 1000


@pytest.mark.parametrize("row", ["[1, 2, 3]", "[1, 1e400, 0, 0]", f"[1, {'9' * 400}, 0, 0]"])
def test_samples_are_four_finite_numbers(capture, tmp_path, row):
    message = f'{{"q": "adxl345:adxl345", "params": {{"data": [{row}]}}}}\x03'
    path = tmp_path / "odd.json"
    path.write_bytes(capture(packed=False).read_bytes() + message.encode())
    with pytest.raises(InputError, match="no data of adxl345 adxl345"):
        import_motan(path, "x,y", (0.125, 0.125), RADIUS)
