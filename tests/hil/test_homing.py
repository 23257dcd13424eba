"""Homing by the real firmware: the emulated plant closes and opens the switches by its position."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.drive import Drive
from corexy_fmi.hil.homing import FOR_HOMING, Homing, Switches, home
from corexy_fmi.hil.limits import Allowed, Limits, Scale
from corexy_fmi.hil.loop import Gains
from corexy_fmi.hil.protocol import ADVICE, Cause, Flag, State, Status, Type
from corexy_fmi.hil.segments import Segment, plan
from corexy_fmi.machine import load_machine
from tests.hil.dc_rig import COUNTS, SUPPLY, DcRig
from tests.hil.kit import give, wait
from tests.hil.rig import STEPS, Rig, Stage, yin

AT = (-0.004, 0.003)  # [m] where the switches are here: x below, y above
HYSTERESIS = 2e-4  # [m] by which a switch closes later than it opened
PINS = ("B1", "B2")


class Switched:
    """The limit switches of a stage, on the pins of a rig."""

    def __init__(self, rig: Rig, at: tuple[float, float] = AT, pins: tuple[str, str] = PINS):
        self.rig, self.at, self.pins = rig, at, pins
        self.open = [False, False]
        self.opened: list[tuple[int, tuple[int, int]]] = []  # axis, and what the pins had counted
        inner = rig.read

        def read(wait: float) -> bytes:
            self.follow()
            return inner(wait)

        rig.read = read  # type: ignore[method-assign]

    def follow(self) -> None:
        place = (self.rig.stage.x, self.rig.stage.y) if self.rig.stage else (0.0, 0.0)
        for axis, (at, now) in enumerate(zip(self.at, place, strict=True)):
            beyond = (now - at) * np.sign(at)
            level = beyond > (-HYSTERESIS if self.open[axis] else 0.0)
            if level != self.open[axis]:
                self.open[axis] = bool(level)
                self.rig.emulator.pin(self.pins[axis], int(level))
                if level:
                    self.opened.append((axis, self.rig.counts))


@pytest.fixture
def rig() -> Iterator[Rig]:
    with Rig(Stage()) as made:
        yield made


def configured(rig: Rig, at: tuple[float, float] = AT) -> tuple[Board, Scale, Homing]:
    """A board whose place nobody knows, and what it is to do."""
    board = Board(rig)
    scale = Scale.of(board.connect(), yin(), STEPS)
    limits = Limits.of(yin(), scale, Allowed())
    board.configure(limits)
    homing = Homing.of(yin(), scale, limits, Switches(*AT, speed=0.02))
    return board, scale, replace(homing, place=(round(2 * at[0] * scale.per_metre),
                                                round(2 * at[1] * scale.per_metre)))  # fmt: skip


def test_counts_are_those_of_the_switches_to_a_step(rig: Rig) -> None:
    switches = Switched(rig)
    board, scale, homing = configured(rig)
    assert home(board, homing) == ""
    status = board.fresh_status()
    assert status.state is State.IDLE
    assert status.flags & Flag.POSITION_KNOWN
    assert [axis for axis, _ in switches.opened] == [0, 0, 1, 1]  # fast, then slowly
    shift = np.array(status.counts) - rig.counts
    for axis, sign in enumerate((1, -1)):
        counts = np.array(switches.opened[2 * axis + 1][1]) + shift
        assert counts[0] + sign * counts[1] == pytest.approx(homing.place[axis], abs=3)
    assert rig.stage is not None
    # friction bends the belts one way at the switch, the other way after the pull-off
    place = rig.stage.x, rig.stage.y
    assert scale.place(status.counts) == pytest.approx(place, abs=1.2e-4)


def test_homing_again_finds_the_same_place(rig: Rig) -> None:
    Switched(rig)
    board, _, homing = configured(rig)
    shifts = []
    for _ in range(2):
        assert home(board, homing) == ""
        shifts.append(np.array(board.fresh_status().counts) - rig.counts)
    assert np.abs(shifts[1] - shifts[0]).max() <= 1


def test_a_motion_follows_homing(rig: Rig) -> None:
    Switched(rig)
    board, scale, homing = configured(rig)
    assert home(board, homing) == ""
    counts = board.fresh_status().counts
    start = scale.angle(counts[0]), scale.angle(counts[1])
    angles = np.array([start, [start[0] + 0.2, start[1] - 0.1]])
    log = Drive(board, plan(np.array([0.0, 0.2]), angles, scale, counts)).run()
    assert log.complete


@pytest.mark.parametrize("speed", [0.0, 0.2])
def test_a_speed_that_no_switch_stops_is_refused(rig: Rig, speed: float) -> None:
    _, scale, _ = configured(rig)
    limits = Limits.of(yin(), scale, Allowed())
    with pytest.raises(InputError, match="--home-speed"):
        Homing.of(yin(), scale, limits, Switches(speed=speed))


def test_a_switch_off_the_stage_is_refused(rig: Rig) -> None:
    _, scale, _ = configured(rig)
    limits = Limits.of(yin(), scale, Allowed())
    for switches in (Switches(x=0.2), Switches(x=0.001)):
        with pytest.raises(InputError, match="--at-x"):
            Homing.of(yin(), scale, limits, switches)


def test_nothing_homes_unless_armed(rig: Rig) -> None:
    board, _, homing = configured(rig)
    assert board.request(Type.HOME, homing.pack()) is Cause.REFUSED_STATE
    assert board.request(Type.ARM) is Cause.REFUSED_STATE  # for a motion: nobody knows the place
    board.command(Type.ARM, FOR_HOMING)
    assert give(board, Segment(100, 1000, 0)) is Cause.REFUSED_STATE
    fast = replace(homing, seek=(1 << 30, 1 << 30))
    assert board.request(Type.HOME, fast.pack()) is Cause.BY_RATE
    assert board.fresh_status().state is State.ARMED
    assert rig.counts == (0, 0)


def test_an_open_switch_refuses_it(rig: Rig) -> None:
    board, _, _ = configured(rig)
    rig.emulator.pin("B2", 1)
    wait(board, 2e-3)
    assert board.request(Type.ARM, FOR_HOMING) is Cause.BY_LIMIT_SWITCH


def begun(rig: Rig) -> Board:
    """On its way to the switch of x, of which it knows only that it must come."""
    board, _, homing = configured(rig)
    board.command(Type.ARM, FOR_HOMING)
    board.command(Type.HOME, homing.pack())
    wait(board, 0.1)
    assert board.fresh_status().state is State.HOMING
    return board


def press(pin: str) -> Callable[[Rig, Board], None]:
    return lambda rig, board: rig.emulator.pin(pin, 1)


@pytest.mark.parametrize(
    ("strike", "cause", "after"),
    [
        (press("C0"), Cause.BY_ESTOP_PIN, 0.05),
        (lambda rig, board: board.send(Type.ESTOP), Cause.BY_ESTOP_FRAME, 1.0),
        (press("B2"), Cause.BY_LIMIT_SWITCH, 0.05),  # not the switch that is looked for
        (lambda rig, board: board.send(Type.STOP), Cause.BY_HOST, 5.0),
        (lambda rig, board: None, Cause.BY_WATCHDOG, 205.0),  # the host falls silent
    ],
    ids=["e-stop pin", "e-stop frame", "other switch", "stop", "silence"],
)
def test_what_stops_a_motion_stops_homing(
    rig: Rig, strike: Callable[[Rig, Board], None], cause: Cause, after: float
) -> None:
    board = begun(rig)
    struck = rig.emulator.cycle
    strike(rig, board)
    for _ in range(400):
        board.poll()
    status = board.fresh_status()
    assert (status.state, status.fault) == (State.FAULT, cause)
    assert not status.flags & Flag.POSITION_KNOWN
    last = max(int(rig.rising(bit)[0].max()) for bit in (2, 3))
    assert (last - struck) / 16e3 < after  # [ms]
    off = cause in (Cause.BY_ESTOP_PIN, Cause.BY_ESTOP_FRAME)
    assert bool(status.flags & Flag.DRIVERS_ON) is not off


def test_a_switch_that_never_comes_ends_it(rig: Rig) -> None:
    board, scale, homing = configured(rig)
    short = replace(homing, travel=(round(0.005 * scale.per_metre),) * 2)
    assert home(board, short) == ADVICE[Cause.BY_HOMING]
    assert abs(rig.counts[0]) == pytest.approx(0.005 * scale.per_metre, rel=0.02)


def test_a_switch_that_stays_open_ends_it(rig: Rig) -> None:
    board, _, homing = configured(rig)
    rig.events.append((rig.now() + 0.2, lambda: rig.emulator.pin("B1", 1)))
    assert home(board, homing) == ADVICE[Cause.BY_HOMING]


def test_a_switch_that_opens_for_a_moment_is_no_place(rig: Rig) -> None:
    switches = Switched(rig)
    board, _, homing = configured(rig)
    seen = [0]

    def watch(message: object, now: float) -> None:
        if isinstance(message, Status) and len(switches.opened) == 1 and not switches.open[0]:
            seen[0] += 1
            if seen[0] == 25:  # on its way back to the switch, slowly
                rig.emulator.pin("B1", 1)
            if seen[0] == 27:
                rig.emulator.pin("B1", 0)

    board.listeners.append(watch)
    assert home(board, homing) == ADVICE[Cause.BY_HOMING]


def test_interrupt_stops_it(rig: Rig) -> None:
    board, _, homing = configured(rig)

    def interrupt(message: object, now: float) -> None:
        if rig.now() > 0.3:
            board.listeners.clear()
            raise KeyboardInterrupt

    board.listeners.append(interrupt)
    assert "interrupted" in home(board, homing)
    wait(board, 0.1)
    status = board.fresh_status()
    assert (status.state, status.fault) == (State.FAULT, Cause.BY_HOST)


def test_the_dc_build_homes_too() -> None:
    machine = load_machine("yin2018_dc")
    with DcRig() as rig:
        rig.stage = rig.dc  # type: ignore[assignment]
        Switched(rig, pins=("D2", "D3"))
        board = Board(rig)
        scale = Scale.of(board.connect(), machine, COUNTS)
        limits = Limits.of(machine, scale, Allowed())
        board.configure(limits)
        board.command(Type.GAINS, Gains.of(machine, scale, SUPPLY).pack())
        assert home(board, Homing.of(machine, scale, limits, Switches(*AT))) == ""
        x, y = scale.place(board.fresh_status().counts)
        assert (x, y) == pytest.approx((rig.dc.x, rig.dc.y), abs=1.2e-4)
        rig.stage = None
