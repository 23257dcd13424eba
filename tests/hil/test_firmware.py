"""The firmware alone: what it refuses, how it stops, and that no counter's wrap costs a step."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator

import numpy as np
import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.hil import protocol
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.limits import Allowed, Limits, Scale
from corexy_fmi.hil.protocol import PAIR, SEGMENT, Cause, Flag, State, Type
from corexy_fmi.hil.segments import END, Segment
from tests.hil.emulator import ROOT
from tests.hil.kit import bench, give, jitter, prepare, start, wait
from tests.hil.rig import STEPS, Rig, yin

SLOW = 1 << 27  # [2^-32 steps/tick] 781 steps/s


@pytest.fixture
def rig() -> Iterator[Rig]:
    with Rig() as made:
        yield made


def armed(rig: Rig, allowed: Allowed | None = None) -> tuple[Board, Limits]:
    """A board with its limits set and its drivers on."""
    board = Board(rig)
    limits = Limits.of(yin(), Scale.of(board.connect(), yin(), STEPS), allowed or Allowed())
    prepare(board, limits)
    board.command(Type.ARM)
    return board, limits


def test_both_sides_name_the_same_numbers() -> None:
    text = (ROOT / "firmware/protocol.h").read_text()
    for name, value in re.findall(r"(\w+) = (0x[0-9a-f]+)", text):
        assert Type[name] == int(value, 16)
    assert f"PROTOCOL_VERSION {protocol.VERSION}" in text
    assert f"SEGMENT_SIZE {SEGMENT.size}" in text
    for kind, first in ((State, "IDLE"), (Cause, "NOTHING")):
        body = re.search(rf"enum \{{\s*({first}\b.*?)\}}", text, re.S)
        assert body is not None
        names = re.findall(r"\b([A-Z_]{4,})\b", re.sub(r"/\*.*?\*/", "", body[1], flags=re.S))
        assert [member.name for member in kind] == names
    for name, value in re.findall(r"#define (\w+) (0x[0-9a-f]+)", text):
        assert Flag[name] == int(value, 16)


@pytest.mark.parametrize(
    ("segments", "why"),
    [
        ([Segment(100, 0x7FFFFFFF, 0)], Cause.BY_RATE),
        ([Segment(100, 1 << 30, 0)], Cause.BY_ACCELERATION),
        ([Segment(100, SLOW, 0), Segment(100, -SLOW, 0)], Cause.BY_REVERSAL),
        ([Segment(65535, SLOW, SLOW)] * 5, Cause.BY_POSITION),
        ([Segment(0, SLOW, 0)], Cause.BY_RATE),
    ],
)
def test_a_bad_segment_stops_before_it_moves(rig: Rig, segments: list[Segment], why: Cause) -> None:
    board, _ = armed(rig, Allowed(speed=0.12))
    assert give(board, *segments) is why
    status = board.fresh_status()
    assert (status.state, status.fault) == (State.FAULT, why)
    assert rig.counts == (0, 0)


def test_frames_are_taken_whole_or_not_at_all(rig: Rig) -> None:
    board, _ = armed(rig)
    free = board.fresh_status().free
    assert give(board, Segment(100, SLOW, 0), Segment(100, -SLOW, 0)) is Cause.BY_REVERSAL
    assert board.fresh_status().free == free


def test_order_full_and_form_are_refused_without_a_stop(rig: Rig) -> None:
    board, _ = armed(rig)
    rest = Segment(1000, 0, 0)
    assert give(board, rest, number=1) is Cause.REFUSED_ORDER
    assert give(board, rest, number=0) is Cause.NOTHING
    assert give(board, rest, number=0) is Cause.NOTHING  # a duplicate is known
    assert board.fresh_status().free == 63
    for number in range(1, 64):
        assert give(board, rest, number=number) is Cause.NOTHING
    assert give(board, rest, number=64) is Cause.REFUSED_FULL
    assert board.fresh_status().state is State.ARMED


def test_nothing_moves_unless_everything_is_known(rig: Rig) -> None:
    board = Board(rig)
    board.connect()
    assert board.request(Type.ARM) is Cause.REFUSED_STATE
    assert give(board, Segment(100, SLOW, 0)) is Cause.REFUSED_STATE
    limits = Limits.of(yin(), Scale.of(board.connect(), yin(), STEPS), Allowed())
    with pytest.raises(InputError, match="--centred"):
        prepare(board, limits, centred=False)
    rig.emulator.pin("B2", 1)
    prepare(board, limits)
    assert board.request(Type.ARM) is Cause.BY_LIMIT_SWITCH
    assert board.fresh_status().flags & Flag.SWITCH_Y


def test_an_empty_queue_ends_in_a_ramp(rig: Rig) -> None:
    board, _ = armed(rig, Allowed(acceleration=0.2))
    assert give(board, Segment(2500, SLOW, -SLOW)) is Cause.NOTHING
    start(board)
    wait(board, 0.5)
    status = board.fresh_status()
    assert (status.state, status.fault) == (State.FAULT, Cause.BY_UNDERRUN)
    assert status.flags & Flag.POSITION_KNOWN
    assert status.counts == rig.counts
    assert rig.counts[0] > 2500 * SLOW >> 32  # a few steps of the ramp
    assert rig.counts[0] == pytest.approx(-rig.counts[1], abs=1)
    cycles, _ = rig.rising(2)
    assert np.diff(cycles)[-1] > 1.5 * np.diff(cycles)[10]  # slower and slower


def test_a_limit_switch_ends_a_ramp_too(rig: Rig) -> None:
    board, _ = armed(rig, Allowed(acceleration=0.02))
    assert give(board, Segment(2500, SLOW, SLOW)) is Cause.NOTHING
    start(board)
    wait(board, 0.2)
    assert board.fresh_status().state is State.STOPPING  # the queue ran dry
    rig.emulator.pin("B1", 1)
    struck = rig.emulator.cycle
    wait(board, 0.5)
    status = board.fresh_status()
    assert (status.state, status.fault) == (State.FAULT, Cause.BY_LIMIT_SWITCH)
    assert (int(rig.rising(2)[0].max()) - struck) / 16e3 < 0.05  # [ms]
    assert not status.flags & Flag.POSITION_KNOWN


def test_watchdog_holds_while_nothing_moves(rig: Rig) -> None:
    board, _ = armed(rig)
    wait(board, 0.4, beat=False)
    status = board.fresh_status()
    assert (status.state, status.fault) == (State.FAULT, Cause.BY_WATCHDOG)


@pytest.mark.parametrize(("jump", "known"), [(0.05, True), (0.005, False)])
def test_the_ramp_ends_at_the_edge_of_the_stage(rig: Rig, jump: float, known: bool) -> None:
    """Where a motor may not stop so suddenly, nobody knows the place any more."""
    board, limits = armed(rig, Allowed(acceleration=0.05, jump=jump))
    board.command(Type.CLEAR)
    edge = limits.x // 2 - 80
    board.command(Type.ORIGIN, PAIR.pack(edge, edge))
    board.command(Type.ARM)
    slower = Segment(2500, SLOW // 2, SLOW // 2)
    assert give(board, slower, Segment(1000, SLOW, SLOW)) is Cause.NOTHING
    start(board)
    wait(board, 0.6)
    a, b = board.fresh_status().counts
    assert a + b <= limits.x + 4  # within the millisecond in which the ramp looks
    assert bool(board.fresh_status().flags & Flag.POSITION_KNOWN) is known


def test_the_tick_counter_may_wrap_in_a_run(rig: Rig) -> None:
    Board(rig).connect()
    late = (1 << 32) - 40_000
    # the interrupt may be about to write what it read before
    while struct.unpack("<I", rig.emulator.memory("tick", 4))[0] < late:
        rig.emulator.poke("tick", struct.pack("<I", late))
        rig.emulator.poke("last", struct.pack("<I", late))  # of the millisecond
        rig.emulator.run(1e-4)
    prepared = bench(rig)
    log = prepared.drive()
    assert log.complete
    assert log.start < 1 << 32 < log.reports[-1][0]
    latest, _ = jitter(rig, log)
    assert latest < 10


def test_frame_numbers_may_wrap(rig: Rig) -> None:
    board, _ = armed(rig)
    rig.emulator.poke("next_frame", struct.pack("<H", 65_530))
    for number in range(65_530, 65_540):
        code = give(board, Segment(1000, SLOW, 0), number=number)
        assert code is Cause.NOTHING
    assert give(board, Segment(2, 0, 0), END, number=65_540) is Cause.NOTHING
    start(board)
    wait(board, 1.0)
    status = board.fresh_status()
    assert (status.state, status.next_frame) == (State.ARMED, 65_541 % 65_536)
    assert status.counts == rig.counts == ((10_000 * SLOW + (1 << 31)) >> 32, 0)


def test_a_hung_firmware_resets_with_its_drivers_off(rig: Rig) -> None:
    board, _ = armed(rig)
    assert rig.emulator.memory_at(0x25) & 1 == 0  # drivers on
    rig.emulator.poke_at(0x6F, 0)  # TIMSK1: the tick stops, nothing wakes it any more
    wait(board, 0.2, beat=False)
    assert board.restarts == 1
    assert rig.emulator.memory_at(0x25) & 1 == 1
