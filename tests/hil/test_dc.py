"""The dc firmware: PWM to volts to the FMU to quadrature to its loop, against the direct dc run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from corexy_fmi.corners import corner_table
from corexy_fmi.fmu.runner import run_fmu
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.drive import Drive, Log
from corexy_fmi.hil.limits import Allowed, Limits, Scale
from corexy_fmi.hil.loop import Gains
from corexy_fmi.hil.motions import with_approach
from corexy_fmi.hil.protocol import Cause, Type
from corexy_fmi.hil.record import recording
from corexy_fmi.hil.segments import check
from corexy_fmi.hil.tracker import Tracker
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import command
from corexy_fmi.recording import Recording
from tests.hil.dc_rig import COUNTS, SUPPLY, DcRig
from tests.hil.kit import SHAPE, prepare
from tests.hil.rig import RigLines, fmu

MACHINE = load_machine("yin2018_dc")
COUNT = 2 * np.pi * 5e-3 / COUNTS  # [m] of belt


@pytest.fixture
def rig() -> Iterator[DcRig]:
    with DcRig() as made:
        yield made


def drive(rig: DcRig) -> tuple[Log, Recording | None, Board]:
    """The rectangle on the dc board."""
    board = Board(rig)
    scale = Scale.of(board.connect(), MACHINE, COUNTS)
    limits = Limits.of(MACHINE, scale, Allowed(jump=0.1))
    status = prepare(board, limits)
    board.command(Type.GAINS, Gains.of(MACHINE, scale, SUPPLY).pack())
    plan, begin = with_approach(command(SHAPE.motion, scale.radius), scale, status.counts)
    check(plan, limits)
    tracker = Tracker(RigLines(rig))
    log = Drive(board, plan, tracker).run()
    made = recording("r.csv", log, board, tracker, begin, {}) if log.complete else None
    return log, made, board


def direct() -> Recording:
    """The same rectangle, driven by the loop around the FMU."""
    order = command(SHAPE.motion, MACHINE.parameters["pulley_radius"])
    assert MACHINE.controller is not None
    loop = f"pd kp={MACHINE.controller.kp!r} kd={MACHINE.controller.kd!r}"
    return run_fmu(fmu(), replace(order, metadata={"controller": loop}), MACHINE)


def test_dc_rectangle_is_that_of_the_fmu(rig: DcRig) -> None:
    log, made, board = drive(rig)
    assert log.trouble == ""
    assert made is not None
    for mine, theirs in zip(corner_table(made, SHAPE), corner_table(direct(), SHAPE), strict=True):
        assert abs(mine.contour_error - theirs.contour_error) < 4 * COUNT
    for _ in range(50):  # until it stands
        rig.read(0.0)
    assert board.fresh_status().counts == rig.dc.counts


def test_a_reversed_encoder_is_cut_off(rig: DcRig) -> None:
    rig.wires = lambda counts: (-counts[0], counts[1])
    log, *_ = drive(rig)
    assert log.cause is Cause.BY_COUNTS  # it runs away
    assert "encoder" in log.trouble
    assert not log.known
    assert rig.volts == (0.0, 0.0)


def test_a_dead_encoder_is_cut_off(rig: DcRig) -> None:
    rig.wires = lambda counts: (counts[0], 0)
    log, *_ = drive(rig)
    assert log.cause is Cause.BY_ENCODER
    assert rig.volts == (0.0, 0.0)
