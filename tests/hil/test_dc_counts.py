"""Encoder counts of the dc firmware: never lost below the documented rate, never unseen above."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corexy_fmi.commands.hil_run import Setup, drive_on
from corexy_fmi.errors import InputError
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.drive import Drive
from corexy_fmi.hil.limits import Allowed, Limits, Scale
from corexy_fmi.hil.loop import Gains
from corexy_fmi.hil.protocol import PAIR, Cause, Flag, Message, State, Status, Type
from corexy_fmi.hil.segments import Segment, check, plan
from corexy_fmi.hil.tracker import Tracker
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import command
from corexy_fmi.rectangle import Rectangle
from tests.hil.dc_rig import COUNTS, PARTS, SUPPLY, DcRig
from tests.hil.kit import give, prepare, wait
from tests.hil.rig import RigLines

MACHINE = load_machine("yin2018_dc")
ORIGIN = 65_000, -65_000  # from here counts pass 16 bits
FASTEST = 40  # [counts/ms] of a reference, board.h


@pytest.fixture
def rig() -> Iterator[DcRig]:
    with DcRig() as made:
        yield made


def ready(rig: DcRig) -> tuple[Board, Scale]:
    """Connected, centred, its loop set; room for a few revolutions."""
    board = Board(rig)
    scale = Scale.of(board.connect(), MACHINE, COUNTS)
    limits = replace(Limits.of(MACHINE, scale, Allowed(2.0, 20.0, 2.0)), x=10**6, y=10**6)
    prepare(board, limits)
    board.command(Type.GAINS, Gains.of(MACHINE, scale, SUPPLY).pack())
    return board, scale


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize(
    ("one", "two"), [(20.0, 19.0), (24.0, 23.0), (25.0, 24.0), (37.3, 36.9), (50.0, 50.0)]
)
def test_no_encoder_count_is_lost(rig: DcRig, one: float, two: float, turn: int) -> None:
    board, _ = ready(rig)
    board.command(Type.ORIGIN, PAIR.pack(*ORIGIN))
    turned = [0]

    def wires(counts: tuple[int, int]) -> tuple[int, int]:
        turned[0] += 1
        return round(turned[0] * one / PARTS), turn * round(turned[0] * two / PARTS)

    rig.wires = wires
    wait(board, 0.3)
    goal = wires((0, 0))
    rig.wires = lambda counts: goal
    wait(board, 2e-3)
    assert board.fresh_status().counts == (ORIGIN[0] + goal[0], ORIGIN[1] + goal[1])


def test_no_count_is_lost_in_the_fastest_run(rig: DcRig) -> None:
    """Loop, segments, reports and both encoders at the fastest reference that is taken."""
    board, scale = ready(rig)
    assert scale.fastest == FASTEST << 20
    time, ends = np.array([0.0, 0.5]), np.array([0, FASTEST * 500])
    made = plan(time, np.column_stack([ends, -ends]) * 2 * np.pi / COUNTS, scale, (0, 0))
    drive = Drive(board, made)

    def follow(counts: tuple[int, int]) -> tuple[int, int]:
        # the firmware's own tick says where the reference is; it is at most a report old
        status = board.status
        if heard and status is not None and drive.log.start:
            late = (rig.emulator.time - heard[-1]) * 1e3
            now = min(max(status.tick + late - drive.log.start, 0.0), 500.0)
            turned[0] = max(turned[0], round(FASTEST * now))
        return turned[0], -turned[0]

    turned = [0]
    heard: list[float] = []

    def hear(message: Message, now: float) -> None:
        if isinstance(message, Status):
            heard.append(rig.emulator.time)

    board.listeners.append(hear)
    rig.wires = follow
    log = drive.run()
    assert log.trouble == ""
    wait(board, 0.02)
    assert board.fresh_status().counts == (FASTEST * 500, -FASTEST * 500)


def test_a_faster_reference_is_refused(rig: DcRig) -> None:
    board, scale = ready(rig)
    limits = Limits.of(MACHINE, scale, Allowed(2.0, 20.0, 2.0))
    time = np.array([0.0, 0.1])
    made = plan(time, np.array([[0, 0], [6.5, 6.5]]), scale, (0, 0))
    with pytest.raises(InputError, match="the firmware's 40000 counts/s"):
        check(made, limits)
    board.command(Type.ARM)
    assert give(board, Segment(10, scale.fastest + 1, 0)) is Cause.BY_RATE
    assert board.fresh_status().state is State.FAULT


def test_a_missed_edge_is_no_silent_loss(rig: DcRig) -> None:
    board, _ = ready(rig)
    for pin in ("C0", "C1"):  # both channels at once: one edge too many, or too few
        rig.emulator.pin(pin, 1)
    board.poll()
    status = board.fresh_status()
    assert (status.state, status.fault) == (State.FAULT, Cause.BY_COUNTS)
    assert not status.flags & Flag.POSITION_KNOWN


def test_a_runaway_is_cut_off_by_the_encoders_themselves(rig: DcRig) -> None:
    board = Board(rig)
    scale = Scale.of(board.connect(), MACHINE, COUNTS)
    prepare(board, Limits.of(MACHINE, scale, Allowed()))
    board.command(Type.GAINS, Gains.of(MACHINE, scale, SUPPLY).pack())
    board.command(Type.ARM)
    goal = 0
    for _ in range(20):  # 300 000 counts/s: no interrupt can follow
        goal += 300
        rig.emulator.encoders(goal, 0)
        ran = rig.emulator.run(1e-3)
    assert ran.duties == (0, 0)
    rig.wires = lambda counts: (goal, 0)
    status = board.fresh_status()
    assert status.fault is Cause.BY_COUNTS
    assert not status.flags & Flag.POSITION_KNOWN


def test_the_command_drives_a_dc_board(rig: DcRig, tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    allowed = Allowed(jump=0.1)
    setup = Setup(
        machine=MACHINE, port="rig", out=out, allowed=allowed, tracker="rig", centred=True,
        arm=True, supply=SUPPLY,
    )  # fmt: skip
    order = command(Rectangle(0.005, 0.004, 0.039).motion, 5e-3)
    made = drive_on(setup, Board(rig), order, Tracker(RigLines(rig)))
    assert made is not None
    assert made.metadata["run"] == "complete"
    assert "phi1_meas" in made.measured
    assert made.metadata["controller"].startswith("pd kp=")
