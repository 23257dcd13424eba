"""Motions start, end and turn where and when they should; rows stand at every corner."""

import numpy as np
import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import (
    chain,
    check_stage,
    chirp,
    circle,
    command,
    line,
    rest,
    row_times,
    star,
)
from corexy_fmi.rectangle import Rectangle

RADIUS = 5e-3


def positions(order):
    x = RADIUS * (order["phi1"] + order["phi2"]) / 2
    return np.column_stack([x, RADIUS * (order["phi1"] - order["phi2"]) / 2])


@pytest.mark.parametrize("acceleration", [None, 0.5, 50.0])
@pytest.mark.parametrize("loops", [1, 3])
def test_rectangle_stands_on_its_vertices(acceleration, loops):
    shape = Rectangle(0.06, 0.04, 0.039, loops, acceleration)
    order = command(shape.motion, RADIUS)
    rows = np.searchsorted(order.time, shape.vertex_times - 1e-12)
    assert order.time[rows] == pytest.approx(shape.vertex_times, abs=1e-12)
    assert positions(order)[rows] == pytest.approx(shape.vertices, abs=1e-15)
    assert order.time[-1] == pytest.approx(shape.vertex_times[-1] + 0.5)


def test_rectangle_runs_centred_from_bottom_left_counter_clockwise():
    vertices = Rectangle(0.06, 0.04, 0.02).vertices
    expected = [(-0.03, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.03, 0.02), (-0.03, -0.02)]
    assert vertices.tolist() == [list(point) for point in expected]


def test_constant_speed_is_constant():
    order = command(Rectangle(0.06, 0.04, 0.039).motion, RADIUS)
    moving = order.time < Rectangle(0.06, 0.04, 0.039).vertex_times[-1]
    path = positions(order)[moving]
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1) / np.diff(order.time[moving])
    assert speed == pytest.approx(np.full(len(speed), 0.039), rel=1e-9)


def test_rows_are_the_grid_of_a_millisecond_and_the_corners():
    shape = Rectangle(0.06, 0.04, 0.039)
    time = row_times(shape.motion, 1000.0)
    assert np.all(np.diff(time) > 1e-9)
    grid = np.arange(int(time[-1] * 1000)) / 1000
    assert np.isin(grid, time).all()
    assert len(time) == len(grid) + 1 + 4 + 1  # corners off the grid, the end of the rest


def test_corners_on_the_grid_add_no_rows():
    time = row_times(Rectangle(0.06, 0.04, 0.02).motion, 1000.0)
    assert time == pytest.approx(np.arange(10501) / 1000, abs=1e-12)


def test_trapezoid_keeps_its_speed_and_acceleration():
    move = line((0, 0), (0.1, 0), 0.2, 2.0)
    assert move.duration == pytest.approx(0.1 / 0.2 + 0.2 / 2.0)
    time = np.linspace(0, move.duration, 100_001)
    x = move.position(time)[:, 0]
    speed = np.gradient(x, time)
    assert speed.max() == pytest.approx(0.2, rel=1e-6)
    assert np.abs(np.gradient(speed, time)).max() == pytest.approx(2.0, rel=1e-3)
    assert (x[0], x[-1]) == pytest.approx((0.0, 0.1), abs=1e-15)


def test_a_short_way_is_a_triangle():
    move = line((0, 0), (0, 0.01), 1.0, 4.0)
    assert move.duration == pytest.approx(2 * np.sqrt(0.01 / 4.0))
    assert move.end == pytest.approx((0.0, 0.01))


def test_circle_keeps_its_radius():
    motion = circle(0.03, 0.05, loops=2, acceleration=1.0, centre=(0.01, 0.0))
    path = motion.position(np.linspace(0, motion.duration, 999)) - (0.01, 0.0)
    assert np.linalg.norm(path, axis=1) == pytest.approx(np.full(999, 0.03))
    assert motion.end == pytest.approx((0.04, 0.0))


def test_star_goes_both_ways_in_every_direction():
    motion = star(0.02, 5, 0.05)
    path = motion.position(np.array(motion.instants))
    assert np.linalg.norm(path[::2], axis=1) == pytest.approx(np.full(5, 0.02))
    assert motion.end == pytest.approx((0.0, 0.0))


def test_chirp_sweeps_and_fades():
    motion = chirp((1, 1), 0.005, (2.0, 20.0), 4.0)
    time = np.linspace(0, 4, 400_001)
    x, y = motion.position(time).T
    assert x == pytest.approx(y)
    assert np.hypot(x, y).max() == pytest.approx(0.005, rel=1e-3)
    velocity = np.gradient(x, time)
    assert abs(velocity[[0, -1]]).max() < 1e-4 * abs(velocity).max()
    crossings = time[20_000 + np.flatnonzero(np.diff(np.sign(x[20_000:-20_000])))]
    frequency = 2.0 + 18.0 * (crossings[1:] + crossings[:-1]) / 2 / 4.0
    assert 2 * np.diff(crossings) * frequency == pytest.approx(np.ones(len(frequency)), rel=0.02)


def test_chain_meets_at_a_row():
    motion = chain(line((0, 0), (0.01, 0), 0.03), rest((0.01, 0), 0.2), circle(0.01, 0.1))
    assert motion.instants == pytest.approx((1 / 3, 1 / 3 + 0.2))
    assert command(motion, RADIUS).time[-1] == pytest.approx(1 / 3 + 0.2 + 0.2 * np.pi)


@pytest.mark.parametrize(("width", "height", "axis"), [(0.2, 0.1, "x"), (0.1, 0.32, "y")])
def test_leaving_the_stage_is_refused(width, height, axis):
    machine = load_machine("yin2018")
    with pytest.raises(InputError, match=rf"\|{axis}\| reaches"):
        check_stage(command(Rectangle(width, height, 0.1).motion, RADIUS), machine)
    check_stage(command(Rectangle(0.18, 0.30, 0.1).motion, RADIUS), machine)


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf")])
def test_sizes_and_speeds_are_positive(bad):
    for sizes in ((bad, 1, 1), (1, bad, 1), (1, 1, bad)):
        with pytest.raises(InputError, match="expected a positive number"):
            Rectangle(*sizes)
    with pytest.raises(InputError, match="expected a positive number"):
        line((0, 0), (1, 0), 1.0, bad)
    with pytest.raises(InputError, match="expected a positive number"):
        line((0, 0), (1, 0), bad)
    with pytest.raises(InputError, match="expected at least 1"):
        Rectangle(1, 1, 1, 0)
