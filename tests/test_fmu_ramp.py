"""inputInterpolation: what an angle does inside a step where no rate comes with it."""

from __future__ import annotations

import pytest
from fmu_kit import FLAVOURS, FMU2Told, slave, template

STEP = 1e-3


def begin(one: FMU2Told, ramp: bool = True) -> FMU2Told:
    """Initialised with a choice."""
    one.setInteger([one.references["inputInterpolation"]], [2 if ramp else 1])
    return one.begin()


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_angles_of_the_end_of_a_step_give_the_bits_of_rates(flavour: str) -> None:
    """A ramp to the angle that is set is the ramp of the rate that leads there."""
    ends = []
    for ramp in (True, False):
        with slave(template(flavour)) as one:
            begin(one, ramp)
            for n in range(40):
                rate = 16.0 if n < 20 else -8.0
                start = 16.0 * STEP * min(n, 20) - 8.0 * STEP * max(n - 20, 0)
                if ramp:
                    one.put(phi1=start + rate * STEP)
                else:
                    one.put(phi1=start, phi1_rate=rate)
                one.doStep(n * STEP, STEP)
            ends.append(one.read("x", "y", "vx", "phi1_meas"))
    assert ends[0] == pytest.approx(ends[1], rel=1e-11)
    assert ends[0][0] > 1e-4


def test_angles_of_the_beginning_come_one_step_late() -> None:
    """The motion is the same, without the jumps of a held angle."""
    with slave() as ramped, slave() as told:
        begin(ramped)
        begin(told, ramp=False)
        told.slope(5.0, 0.0)
        for n in range(30):
            ramped.put(phi1=5.0 * n * STEP)
            ramped.doStep(n * STEP, STEP)
            if n:
                told.doStep((n - 1) * STEP, STEP)
                assert ramped.read("x")[0] == pytest.approx(told.read("x")[0], rel=1e-9, abs=1e-15)
            assert ramped.read("phi1") == [5.0 * n * STEP]


def test_a_held_angle_jumps_and_a_ramped_one_does_not() -> None:
    """Seen by the rotor's speed."""
    speeds = {}
    for ramp in (False, True):
        with slave() as one:
            begin(one, ramp).put(phi1=0.01)
            one.doStep(0.0, STEP)
            speeds[ramp] = one.read("omega1", "phi1_meas")
    assert speeds[False] == [0.0, 0.01]
    assert speeds[True] == pytest.approx([10.0, 0.01])


def test_an_angle_that_is_not_set_again_stands_still() -> None:
    """The ramp has arrived; a rate that comes as an input is not read."""
    with slave() as one:
        begin(one).put(phi1=0.01, phi1_rate=99.0)
        one.doStep(0.0, STEP)
        one.doStep(STEP, STEP)
        assert one.read("phi1_meas", "omega1") == [0.01, 0.0]


def test_a_derivative_counts_more() -> None:
    """And where it ends, the ramp goes on from there."""
    with slave() as one:
        begin(one)
        one.slope(5.0, 0.0)
        one.doStep(0.0, STEP)
        assert one.read("phi1_meas")[0] == pytest.approx(5.0 * STEP)
        one.put(phi1=7.0 * STEP)
        one.doStep(STEP, STEP)
        assert one.read("omega1", "phi1_meas") == pytest.approx([2.0, 7.0 * STEP])


def test_a_state_holds_where_the_ramp_stands() -> None:
    """Saved between two steps."""
    with slave() as one:
        begin(one).put(phi1=0.01)
        one.doStep(0.0, STEP)
        one.put(phi1=0.03)
        saved = one.getFMUstate()
        rows = []
        for _ in range(2):
            one.doStep(STEP, STEP)
            rows.append(one.read("x", "omega1", "phi1"))
            one.setFMUstate(saved)
        assert rows[0] == rows[1]
        assert rows[0][1] == pytest.approx(20.0)
        one.freeFMUstate(saved)
