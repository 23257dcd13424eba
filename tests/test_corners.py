"""Eq. (17) and the overshoot against closed forms."""

import numpy as np
import pytest

from corexy_fmi.corners import contour_error, corner_table, overshoot
from corexy_fmi.motion import command
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle

EAST, NORTH = np.array([1.0, 0.0]), np.array([0.0, 1.0])


def rotated(path, quarter_turns):
    c, s = [(1, 0), (0, 1), (-1, 0), (0, -1)][quarter_turns]
    return path @ np.array([[c, s], [-s, c]])


def fillet(radius, points=20_001):
    """A corner at the origin, from west to north, rounded by an arc on the inside."""
    angle = np.linspace(-np.pi / 2, 0, points)
    arc = np.column_stack([radius * (np.cos(angle) - 1), radius * (np.sin(angle) + 1)])
    return np.concatenate([[[-1.0, 0.0]], arc, [[0.0, 1.0]]])


@pytest.mark.parametrize("turns", range(4))
def test_rounded_corner(turns):
    """An arc of radius R misses its corner by (sqrt 2 - 1) R."""
    path = rotated(fillet(0.01), turns)
    into, out = rotated(EAST, turns), rotated(NORTH, turns)
    error = contour_error(path, (0, 0), into, out)
    assert error == pytest.approx((np.sqrt(2) - 1) * 0.01, rel=1e-8)
    assert overshoot(path, (0, 0), into) == pytest.approx(0, abs=1e-15)


def test_chamfer_is_exact_between_two_rows():
    """Two rows on a chamfer of leg a: the crossing lies a / sqrt 2 inside."""
    path = np.array([[-1.0, 0.0], [-0.02, 0.0], [0.0, 0.02], [0.0, 1.0]])
    assert contour_error(path, (0, 0), EAST, NORTH) == pytest.approx(0.02 / np.sqrt(2))


def test_a_path_outside_is_negative_and_overshoots():
    path = np.array([[-1.0, 0.0], [0.03, -0.03], [0.03, 0.05], [0.0, 1.0]])
    assert contour_error(path, (0, 0), EAST, NORTH) == pytest.approx(-0.03 * np.sqrt(2))
    assert overshoot(path, (0, 0), EAST) == pytest.approx(0.03)


def test_a_row_on_the_line_counts_and_the_nearest_crossing_wins():
    path = np.array([[-1.0, 0.0], [-0.05, 0.05], [0.1, 0.1], [-0.01, 0.01], [0.0, 1.0]])
    assert contour_error(path, (0, 0), EAST, NORTH) == pytest.approx(0.01 * np.sqrt(2))


def test_a_path_that_never_crosses_has_no_error():
    path = np.array([[-1.0, 0.0], [-0.5, 0.0]])
    assert np.isnan(contour_error(path, (0, 0), EAST, NORTH))


def lagging(shape, lags, rate=1000.0):
    """A run whose axes follow the command as first-order lags [s], solved exactly."""
    order = command(shape.motion, 1.0, rate)
    ideal = np.column_stack([order["phi1"] + order["phi2"], order["phi1"] - order["phi2"]]) / 2
    path, steps = ideal.copy(), np.diff(order.time)
    for axis, lag in enumerate(lags):
        for i, h in enumerate(steps):
            speed, decay = (ideal[i + 1, axis] - ideal[i, axis]) / h, np.exp(-h / lag)
            behind = (ideal[i, axis] - path[i, axis]) * decay + lag * speed * (1 - decay)
            path[i + 1, axis] = ideal[i + 1, axis] - behind
    return Recording("run.csv", order.time, {"x": path[:, 0], "y": path[:, 1]})


@pytest.mark.parametrize("loops", [1, 2])
def test_overdamped_corners_follow_the_oracle(loops):
    """tau e^(-s / tau_in) = s - tau_out (1 - e^(-s / tau_out)); error = sqrt 2 v tau e^(...)."""
    from scipy.optimize import brentq

    shape, lags = Rectangle(0.012, 0.008, 0.02, loops), (0.020, 0.008)
    corners = corner_table(lagging(shape, lags, 10_000.0), shape)
    assert len(corners) == 4 * loops - 1
    for corner in corners:
        into, out = lags if corner.turn == "x->y" else lags[::-1]
        meet = brentq(
            lambda s, i=into, o=out: i * np.exp(-s / i) - s + o * (1 - np.exp(-s / o)), 0, 1
        )
        expected = np.sqrt(2) * 0.02 * into * np.exp(-meet / into)
        assert corner.contour_error == pytest.approx(expected, rel=1e-4)
        assert corner.overshoot == pytest.approx(0, abs=1e-12)
    assert [corner.turn for corner in corners[:3]] == ["x->y", "y->x", "x->y"]


def test_an_ideal_run_has_no_error_and_blank_samples_are_passed_over():
    shape = Rectangle(0.06, 0.04, 0.039, 2)
    run = lagging(shape, (1e-9, 1e-9))
    run["x"][10::25] = np.nan
    for corner in corner_table(run, shape):
        assert abs(corner.contour_error) < 1e-7
