"""G-code programs become the paths that they describe, and what is not understood says its line."""

import numpy as np
import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.gcode import read_gcode


def path(tmp_path, text, **options):
    file = tmp_path / "part.gcode"
    file.write_text(text)
    found = read_gcode(file, **options)
    return found.time, np.column_stack([found["x"], found["y"]])


def test_straight_moves_have_their_feed_and_ends(tmp_path):
    time, points = path(tmp_path, "G0 X10 Y10 ; start\nG1 X40 F1200\nY30 (up)\nN7 G1 X40Y30Z2*11")
    assert points[0] == pytest.approx([0.01, 0.01])
    assert points[-1] == pytest.approx([0.04, 0.03])
    assert time[-1] == pytest.approx(0.03 / 0.02 + 0.02 / 0.02)
    assert points[np.searchsorted(time, 1.5 - 1e-9)] == pytest.approx([0.04, 0.01])
    assert np.all(np.diff(time) > 0)


@pytest.mark.parametrize("text", ["G20\nG1 X0 Y0\nG1 X1 F60", "G1 X0 Y0\nG91\nG1 X25.4 F1524"])
def test_inches_and_relative_moves(tmp_path, text):
    time, points = path(tmp_path, text)
    assert points[-1] == pytest.approx([0.0254, 0.0])
    assert time[-1] == pytest.approx(1.0)


def test_a_name_given_by_g92_shifts_what_follows(tmp_path):
    _, points = path(tmp_path, "G1 X10 Y0 F600\nG92 X0\nG1 X5")
    assert points[-1] == pytest.approx([0.015, 0.0])


def test_g92_before_any_move_says_where_it_begins(tmp_path):
    _, points = path(tmp_path, "G92 X0 Y0\nG1 X10 Y0 F600\nG1 X10 Y10")
    assert points[0] == pytest.approx([0.0, 0.0])
    assert points[-1] == pytest.approx([0.01, 0.01])


@pytest.mark.parametrize(("code", "top"), [("G3", 1.0), ("G2", -1.0)])
def test_arcs_turn_the_right_way(tmp_path, code, top):
    time, points = path(tmp_path, f"G1 X10 Y0 F600\n{code} X-10 Y0 I-10 J0")
    assert np.hypot(*points.T) == pytest.approx(np.full(len(points), 0.01), abs=1e-9)
    assert points[len(points) // 2, 1] == pytest.approx(0.01 * top, abs=1e-6)
    assert time[-1] == pytest.approx(np.pi)


def test_an_arc_to_its_start_is_a_full_circle(tmp_path):
    time, points = path(tmp_path, "G1 X10 Y0 F600\nG3 I-10")
    assert time[-1] == pytest.approx(2 * np.pi)
    assert points[-1] == pytest.approx([0.01, 0.0], abs=1e-12)


def test_dwells_and_trapezoids_take_their_time(tmp_path):
    text = "G1 X0 Y0 F6000\nG4 P250\nG1 X20\nG4 S0.5"
    time, _ = path(tmp_path, text, acceleration=2.0)
    assert time[-1] == pytest.approx(0.25 + (0.02 / 0.1 + 0.1 / 2.0) + 0.5)


def test_a_speed_holds_until_the_first_feed(tmp_path):
    time, _ = path(tmp_path, "G0 X0 Y0\nG0 X10\nG1 X20 F600", speed=0.1)
    assert time[-1] == pytest.approx(0.1 + 1.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("G0 X0 Y0\nG0 X10", "line 2: no speed, expected F"),
        ("G1 X0 Y0 F0\nG1 X10", "line 2: no speed"),
        ("G1 X0 Y0 F60\nG5 X10", "line 2: found G5, expected one of G0"),
        ("G1 X0 Y0 F60\nG1 Xa", "line 2: found 'G1 XA', expected words"),
        ("G1 X0 Y0 F60\nG2 X10 R5", "line 2: an arc whose ends"),
        ("G1 X0 Y0 F60\nG2 X10 I3", "line 2: an arc whose ends"),
        ("M104 S200\nG28\n", "no move in X and Y"),
    ],
)
def test_what_is_not_understood_says_where(tmp_path, text, said):
    with pytest.raises(InputError, match=r"part\.gcode") as caught:
        path(tmp_path, text)
    assert said in str(caught.value)
