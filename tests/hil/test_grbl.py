"""The GRBL adapter against the stand-in: steps, timing, buffers, stops.  Time is the stand-in's."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.hil.grbl_drive import Drive
from corexy_fmi.hil.grbl_limits import warnings
from corexy_fmi.hil.grbl_link import Link
from corexy_fmi.hil.grbl_moves import Grid, moves, program
from corexy_fmi.hil.grbl_record import fit, recording
from corexy_fmi.hil.grbl_timing import timeline
from corexy_fmi.motion import circle, command
from corexy_fmi.rectangle import Rectangle
from tests.hil.grbl_firmware import FLUIDNC, GRBL, GRBLHAL, Firmware
from tests.hil.grbl_kit import RADIUS, SHAPE, Bench, Wire, bench, order_of
from tests.hil.grbl_stand_in import StandIn

FAMILIES = {"GRBL": GRBL, "grblHAL": GRBLHAL, "FluidNC": FLUIDNC}
every_family = pytest.mark.parametrize("firmware", FAMILIES.values(), ids=FAMILIES)
SLACK = 5e-3  # [s] between the stand-in's end and the foreseen one: its steps of time
CORNERS = 0.08  # [s] that ramps and corners may cost of the 2.2 s asked, at 2000 mm/s^2


@every_family
@pytest.mark.parametrize("acceleration", [None, 1.0])
def test_rectangle_is_driven_to_the_step(firmware: Firmware, acceleration: float | None) -> None:
    made = bench(StandIn(firmware), Rectangle(0.02, 0.014, 0.039, 1, acceleration))
    log = made.drive()
    motion = made.controller.motion
    assert log.trouble == ""
    assert made.controller.overflowed == 0
    wanted = made.wanted()[:-1]  # the last is the rest
    assert np.array_equal(np.array(motion.vertices)[:, 1:], wanted)
    begin = np.array([sum(made.start), made.start[0] - made.start[1]])
    way = np.abs(np.diff(np.vstack([begin, wanted]), axis=0)).sum(axis=0)
    assert motion.emitted == way.tolist()
    asked = sum(move.seconds for move in made.made[:-1])
    driven = motion.vertices[-1][0] - motion.begun
    assert asked < driven + SLACK
    assert driven < asked + CORNERS
    assert driven == pytest.approx(made.line.end - made.made[-1].seconds, abs=SLACK)


def test_vertices_lie_within_a_step_of_the_command() -> None:
    made = bench()
    made.drive()
    corners = np.array(SHAPE.vertices[1:])
    reached = made.grid.metres(
        np.array([[(a + b) / 2, (a - b) / 2] for _, a, b in made.controller.motion.vertices])
    )
    nearest = [np.abs(reached - corner).max(axis=1).min() for corner in corners]
    assert max(nearest) <= 0.5 / made.grid.per_mm / 1e3 + 1e-12


@pytest.mark.parametrize(
    ("firmware", "feed", "ratio"), [(GRBL, 1.0, 2**0.5), (GRBLHAL, 2**0.5, 2**-0.5)]
)
def test_the_wrong_feed_rule_shows(firmware: Firmware, feed: float, ratio: float) -> None:
    right, wrong = bench(StandIn(firmware)), bench(StandIn(firmware), feed=feed)
    spans = []
    for made in (right, wrong):
        made.drive()
        motion = made.controller.motion
        spans.append(motion.vertices[-1][0] - motion.begun)
    assert spans[1] / spans[0] == pytest.approx(ratio, rel=0.06)


def circling(controller: StandIn) -> Bench:
    """Some hundred short moves: round and round on 4 mm."""
    made = bench(controller)
    grid = Grid(made.grid.per_mm, made.link_steps())
    order = command(circle(0.004, 0.06, 6, centre=(-0.004, 0.0)), RADIUS)
    start, some = moves(order, RADIUS, grid)
    assert made.link.build is not None
    assert made.link.offset is not None
    lines = program(start, some, grid, made.link.offset, made.link.build.feed_factor)
    line = timeline(start, some, grid, made.link.settings, made.link.build.blocks)
    return Bench(made.wire, made.link, grid, start, some, ["G21G90G94", *lines, "G4P0.01"], line)


def test_character_counting_fills_the_buffer_and_never_overflows_it() -> None:
    made = circling(StandIn())
    log = made.drive()
    assert len(made.lines) > 90
    assert log.trouble == ""
    assert (made.controller.overflowed, made.controller.lines) == (0, len(made.lines) + 3)
    assert 100 < log.most <= 127
    assert made.controller.fullest <= 127
    wanted = [tuple(row) for row in made.wanted().tolist()]
    driven = [(a, b) for _, a, b in made.controller.motion.vertices]
    assert driven == [row for row, _ in itertools.groupby(wanted)]


def test_a_lost_host_leaves_few_moves() -> None:
    controller = StandIn()
    made = circling(controller)
    lost = controller.time + 1.0
    later(made, 1.0, lambda wire: setattr(wire, "plugged", False))
    made.drive()
    controller.advance(5.0)
    assert controller.state == "Idle"
    left = controller.motion.vertices[-1][0] - lost
    assert 0.1 < left < 2.2


@pytest.mark.parametrize("size", [64, 128, 1024])
def test_bytes_on_their_way_are_bounded(size: int) -> None:
    info = ("[VER:1.1f.20260818:]", f"[OPT:VNMCSL,15,{size}]", "[FIRMWARE:grblHAL]")
    made = circling(StandIn(Firmware(GRBLHAL.banner, info, head_feed=True)))
    log = made.drive()
    assert log.trouble == ""
    assert log.most <= min(size, 128) - 1


def test_a_wrong_counter_would_show() -> None:
    made = circling(StandIn())
    drive = Drive(made.link, made.lines)
    drive._room = 400
    log = drive.run()
    assert made.controller.overflowed > 0
    assert log.trouble != ""


def test_a_starved_controller_shows_in_the_gap() -> None:
    made = circling(StandIn())
    late = [len(made.lines) // 2]

    def watch(drive: Drive) -> None:
        if drive.answered > late[0]:
            late[0] = 10**6
            made.controller.advance(1.0)  # the host is away

    log = made.drive(watch=watch)
    clock = fit(log, made.line, made.grid, log.answered[0], log.answered[-1])
    assert clock.gap / made.grid.per_mm > 1.0  # [mm]


@pytest.mark.parametrize("work", [1, 0])
@pytest.mark.parametrize("offset", [(0.0, 0.0), (12.345, -6.789)])
def test_reports_lay_the_plan_on_the_hosts_clock(work: int, offset: tuple[float, float]) -> None:
    made = bench(StandIn(settings={10: work}, offset=offset))
    log = made.drive()
    guess = log.answered[0]
    clock = fit(log, made.line, made.grid, guess, log.answered[-1], made.link.offset)
    assert clock.reports > 8
    assert clock.start == pytest.approx(made.controller.motion.begun, abs=5e-3)
    assert clock.gap / made.grid.per_mm < 0.1  # [mm]
    run = recording("r", log, made.line, made.grid, RADIUS, clock, None, {})
    order = order_of()
    assert run["phi1"][-1] == pytest.approx(order["phi1"][-1], abs=2e-3)  # a step of 2 pi/3200
    assert run["phi2"][0] == pytest.approx(order["phi2"][0], abs=2e-3)
    assert "x" not in run


# what goes wrong


def later(made: Bench, seconds: float, what: Callable[[Wire], None]) -> None:
    made.wire.at.append((made.controller.time + seconds, what))


def interrupt(wire: Wire) -> None:
    raise KeyboardInterrupt


@every_family
def test_interrupt_holds_first_then_resets_and_knows_the_place(firmware: Firmware) -> None:
    made = bench(StandIn(firmware))
    later(made, 0.8, interrupt)
    log = made.drive()
    assert log.trouble == "interrupted"
    tail = bytes(made.wire.sent)
    assert tail.index(b"!") < tail.index(b"\x18")
    assert made.controller.state == "Idle"
    assert log.known
    assert log.place == pytest.approx(made.controller.motion.xy, abs=1e-3)
    assert made.controller.motion.vertices[-1][0] < made.controller.time - 0.2
    states = [(h.report.state, h.report.sub) for h in log.reports]
    assert ("Hold", 0) in states


def test_whatever_ends_the_program_stops_the_motion() -> None:
    made = bench()

    def terminate(wire: Wire) -> None:
        raise SystemExit(143)

    later(made, 0.8, terminate)
    with pytest.raises(SystemExit):
        made.drive()
    assert made.controller.state == "Idle"
    assert not made.controller.motion.blocks


@every_family
def test_a_second_interrupt_resets_in_motion(firmware: Firmware) -> None:
    made = bench(StandIn(firmware))
    later(made, 0.8, interrupt)
    later(made, 0.803, interrupt)
    log = made.drive()
    assert "twice" in log.trouble
    assert not log.known


@every_family
@pytest.mark.parametrize(("code", "known"), [(1, False), (2, True)])
def test_alarms_are_told_in_words(firmware: Firmware, code: int, known: bool) -> None:
    made = bench(StandIn(firmware))
    later(made, 0.8, lambda wire: wire.controller.alarm(code))
    log = made.drive()
    assert f"ALARM:{code} (" in log.trouble
    assert log.known is known
    assert log.place is None
    assert b"\x18" not in made.wire.sent  # nobody unlocks it by the way
    assert b"$X" not in made.wire.sent


@every_family
def test_a_reset_after_an_alarm_waits_until_it_is_heard(firmware: Firmware) -> None:
    made = bench(StandIn(firmware))
    made.controller.alarm(1)
    made.link.poll(0.01)
    assert made.link.reset()
    heard = made.link.fresh()
    assert heard.report.state == "Alarm"


def test_a_reset_right_after_an_alarm_is_swallowed() -> None:
    controller = StandIn()
    controller.alarm(1)
    controller.write(b"\x18")
    controller.advance(1.0)
    assert controller.read().endswith(b"[MSG:Reset to continue]\r\n")
    controller.write(b"\x18")
    controller.advance(0.1)
    assert b"Grbl 1.1h" in controller.read()


@pytest.mark.parametrize(
    ("firmware", "code", "words"),
    [(GRBL, 10, "dual axis"), (GRBLHAL, 10, "emergency stop"), (FLUIDNC, 13, "hard stop")],
    ids=FAMILIES,
)
def test_each_family_has_alarms_of_its_own(firmware: Firmware, code: int, words: str) -> None:
    made = bench(StandIn(firmware))
    later(made, 0.8, lambda wire: wire.controller.alarm(code))
    log = made.drive()
    assert words in log.trouble
    assert not log.known


@pytest.mark.parametrize("firmware", [GRBLHAL, FLUIDNC], ids=["grblHAL", "FluidNC"])
def test_a_critical_alarm_refuses_lines_but_reports(firmware: Firmware) -> None:
    made = bench(StandIn(firmware))
    made.controller.alarm(1)
    made.link.poll(0.01)
    heard = made.link.fresh().report
    assert heard.state == "Alarm"
    assert heard.sub == (1 if firmware is GRBLHAL else None)
    with pytest.raises(InputError, match=f"error:{firmware.critical} "):
        made.link.command("G1X1F100")
    assert made.controller.motion.emitted == [0, 0]


def test_fluidnc_tells_few_settings() -> None:
    made = bench(StandIn(FLUIDNC))
    assert not {0, 1, 11, 13, 27} & set(made.link.settings)
    assert {100, 110, 120, 130} <= set(made.link.settings)
    assert made.link.build is not None
    said = " ".join(warnings(made.link.settings, made.link.build))
    assert "idle_ms" in said
    assert "junction deviation" in said


@every_family
def test_errors_stop_the_run(firmware: Firmware) -> None:
    made = bench(StandIn(firmware))
    made.lines.insert(3, "G2X1")
    log = made.drive()
    assert "G2X1: error:20 (unsupported G-code)" in log.trouble
    assert made.controller.state == "Idle"
    assert not made.controller.motion.blocks


@every_family
@pytest.mark.parametrize(
    ("byte", "words"), [(b"!", "feed hold pressed"), (b"\x84", "safety door open")]
)
def test_a_hand_at_the_controller_ends_the_run(firmware: Firmware, byte: bytes, words: str) -> None:
    made = bench(StandIn(firmware))
    later(made, 0.8, lambda wire: wire.controller.write(byte))
    log = made.drive()
    assert words in log.trouble
    assert log.known
    assert log.place == pytest.approx(made.controller.motion.xy, abs=1e-3)


@every_family
def test_a_reset_in_the_run_loses_the_place(firmware: Firmware) -> None:
    made = bench(StandIn(firmware))
    later(made, 0.8, lambda wire: wire.controller.write(b"\x18"))
    log = made.drive()
    assert "ALARM:3" in log.trouble or "reset in the run" in log.trouble
    assert not log.known


@every_family
def test_unplugged_for_a_second(firmware: Firmware) -> None:
    made = bench(StandIn(firmware))

    def pull(wire: Wire) -> None:
        wire.plugged = False

    def plug(wire: Wire) -> None:
        wire.plugged = True

    later(made, 0.8, pull)
    later(made, 1.8, plug)
    log = made.drive()
    assert log.trouble.startswith("link lost")
    assert "it is back" in log.trouble
    assert log.known
    assert log.place == pytest.approx(made.controller.motion.xy, abs=1e-3)
    assert made.controller.state == "Idle"


def test_a_silent_controller_ends_the_run() -> None:
    made = bench()

    def dead(wire: Wire) -> None:
        wire.controller.read = lambda: b""  # type: ignore[method-assign]

    later(made, 0.5, dead)
    log = made.drive()
    assert "silent" in log.trouble
    assert not log.known


def test_nothing_at_the_port_is_said() -> None:
    wire = Wire(StandIn())
    wire.controller.read = lambda: b""  # type: ignore[method-assign]
    with pytest.raises(InputError, match="heard nothing, expected a GRBL controller"):
        Link(wire).connect()
