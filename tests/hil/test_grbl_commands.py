"""What the commands for GRBL check, say and do; the port is the stand-in on a clock of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer

from corexy_fmi.commands import hil_grbl, hil_grbl_watch
from corexy_fmi.commands.hil_grbl import execute_grbl
from corexy_fmi.commands.hil_run import Setup
from corexy_fmi.corners import corner_table, passing_times
from corexy_fmi.errors import InputError
from corexy_fmi.hil.limits import Allowed
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import read_recording
from corexy_fmi.rectangle import Rectangle
from tests.hil.grbl_firmware import FLUIDNC, GRBL, GRBLHAL, Firmware
from tests.hil.grbl_kit import Wire, order_of
from tests.hil.grbl_stand_in import StandIn

SMALL = Rectangle(0.008, 0.006, 0.039)


@pytest.fixture
def setup(tmp_path: Path) -> Setup:
    machine = load_machine("yin2018")
    out = tmp_path / "run.csv"
    return Setup(machine=machine, port="wire", out=out, centred=True, arm=True)


@pytest.fixture
def wire(monkeypatch: pytest.MonkeyPatch) -> Wire:
    made = Wire(StandIn())
    for module in (hil_grbl, hil_grbl_watch):
        monkeypatch.setattr(module, "SerialPort", lambda name, baud: made)
    return made


def powered(wire: Wire, settings: dict[int, float], firmware: Firmware = GRBL) -> StandIn:
    wire.controller = StandIn(firmware, settings=settings)
    return wire.controller


@pytest.mark.parametrize(
    ("settings", "options", "words"),
    [
        ({}, {"centred": False}, "nobody knows where the carriage stands"),
        ({101: 80}, {}, "[$]101=80 steps/mm, expected 101.859"),
        ({1: 25}, {}, "expected [$]1=255"),
        ({110: 1000}, {}, "mm/min of motor 1, expected at most [$]110=1000"),
        ({111: 1000}, {}, "mm/min of motor 2, expected at most [$]111=1000"),
        ({20: 1}, {}, "beyond the controller's travel"),
        ({120: 9000}, {"allowed": Allowed(acceleration=5.0)}, "--max-accel"),
        ({22: 1}, {}, "locked by an alarm"),
        ({}, {"home": True}, "[$]22=0, homing is off"),
        ({}, {"allowed": Allowed(speed=0.01)}, "--max-speed"),
        ({}, {"machine": load_machine("yin2018_dc")}, "GRBL drives steppers only"),
        ({}, {"counts": 0}, "counts per revolution: found 0"),
    ],
)
def test_refused_before_anything_moves(
    setup: Setup, wire: Wire, settings: dict[int, float], options: dict[str, object], words: str
) -> None:
    controller = powered(wire, settings)
    with pytest.raises(InputError, match=words):
        execute_grbl(replace(setup, **options), order_of(SMALL))  # type: ignore[arg-type]
    assert controller.motion.emitted == [0, 0]
    assert b"$X" not in wire.sent
    assert b"$H" not in wire.sent


def test_steps_beyond_the_board_are_refused(setup: Setup, wire: Wire) -> None:
    controller = powered(wire, {100: 1018.592, 101: 1018.592})
    fast = replace(setup, counts=32_000)
    with pytest.raises(InputError, match="steps/s, expected at most 30000"):
        execute_grbl(fast, order_of(SMALL))
    assert controller.motion.emitted == [0, 0]


def test_off_the_stage_is_refused_without_a_controller(setup: Setup, wire: Wire) -> None:
    with pytest.raises(InputError, match="leaves the stage"):
        execute_grbl(setup, order_of(Rectangle(0.3, 0.006, 0.039)))
    assert not wire.sent


def test_nothing_moves_without_arm(
    setup: Setup, wire: Wire, capsys: pytest.CaptureFixture[str]
) -> None:
    assert execute_grbl(replace(setup, arm=False), order_of(SMALL)) is None
    assert "dry run, nothing moves: 1.22 s" in capsys.readouterr().out
    assert not wire.sent
    assert not setup.out.exists()


def test_a_motion_without_way_is_refused(setup: Setup, wire: Wire) -> None:
    with pytest.raises(InputError, match="nothing moves, expected a motion"):
        execute_grbl(setup, order_of(Rectangle(2e-6, 2e-6, 1.0)))


def test_the_way_to_the_start_is_no_part_of_the_recording(setup: Setup, wire: Wire) -> None:
    made = execute_grbl(setup, order_of(SMALL))
    assert made is not None
    order = order_of(SMALL)
    assert made["phi1"][0] == pytest.approx(order["phi1"][0], abs=4e-3)
    assert made.time[-1] == pytest.approx(order.time[-1], abs=0.08)
    assert read_recording(setup.out).metadata["controller_board"].startswith("GRBL 1.1h")


@pytest.mark.parametrize("firmware", [GRBL, GRBLHAL, FLUIDNC], ids=["GRBL", "grblHAL", "FluidNC"])
def test_home_then_drive_at_the_middle_of_the_travel(
    setup: Setup, wire: Wire, capsys: pytest.CaptureFixture[str], firmware: Firmware
) -> None:
    controller = powered(wire, {22: 1, 20: 1, 130: 160, 131: 120}, firmware)
    made = execute_grbl(replace(setup, centred=False, home=True), order_of(SMALL))
    assert made is not None
    x, y = controller.motion.xy
    assert (x, y) == pytest.approx((-80 - 4, -60 - 3), abs=0.01)
    assert "homing" in capsys.readouterr().out


@pytest.mark.parametrize(("acceleration", "slow"), [(2000, False), (100, True)])
def test_a_controller_that_cannot_follow_is_said(
    setup: Setup, wire: Wire, acceleration: int, slow: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    powered(wire, {120: acceleration, 121: acceleration})
    made = execute_grbl(setup, order_of(SMALL))
    said = capsys.readouterr().out
    assert made is not None
    assert f"drives in {made.time[-1]:.2f} s what was asked in 1.22 s" in said
    assert ("do not follow the command" in said) is slow
    assert "did not keep this timing" not in said


def test_home_moves_only_with_arm(wire: Wire, capsys: pytest.CaptureFixture[str]) -> None:
    powered(wire, {22: 1, 130: 160, 131: 120})
    hil_grbl_watch.home_controller("wire", arm=False)
    assert b"$H" not in wire.sent
    hil_grbl_watch.home_controller("wire", arm=True)
    said = capsys.readouterr().out
    assert "nothing moves" in said
    assert "stands at -1.001, -1.001 mm; the middle of its travel is -80.000, -60.000" in said


def test_check_monitor_release(wire: Wire, capsys: pytest.CaptureFixture[str]) -> None:
    controller = powered(wire, {0: 10})
    hil_grbl_watch.show_controller("wire", 1.0)
    said = capsys.readouterr().out
    for words in (
        "GRBL 1.1h.20190830",
        "1.4142",
        "TB6560",
        "128 bytes, 15 motions ahead",
        "0.000, 0.000",
    ):
        assert words in said
    hil_grbl_watch.show_reports("wire", 0.05)
    assert "Idle" in capsys.readouterr().out
    hil_grbl_watch.release_controller("wire")
    assert controller.state == "Sleep"
    hil_grbl_watch.show_controller("wire", 0.5)  # a reset wakes it, locked
    assert controller.state == "Alarm"
    assert controller.motion.emitted == [0, 0]


def test_monitor_looks_at_a_moving_controller(
    wire: Wire, capsys: pytest.CaptureFixture[str]
) -> None:
    wire.controller.write(b"G21G90G94\nG1X50F600\n")
    wire.controller.advance(0.5)
    hil_grbl_watch.show_reports("wire", 0.05)
    assert "Run" in capsys.readouterr().out
    with pytest.raises(InputError, match="state Run, expected Idle"):
        hil_grbl_watch.show_controller("wire", 0.5)


def test_a_recording_keeps_what_the_tracker_saw(
    setup: Setup, wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Lines:
        """A perfect tracker at 100 Hz, 7 s ahead of the host."""

        said = 0.0

        def read(self) -> bytes:
            now = wire.now()
            if now < self.said + 0.01:
                return b""
            self.said = now
            x, y = wire.controller.motion.xy
            return f"{now + 7:.6f} {x / 1e3:.7f} {y / 1e3:.7f}\n".encode()

    monkeypatch.setattr(hil_grbl, "open_lines", lambda name: Lines())
    made = execute_grbl(replace(setup, tracker="t"), order_of(SMALL))
    assert made is not None
    assert made.measured == ("x", "y")
    radius = setup.machine.parameters["pulley_radius"]
    seen = made["x"] == made["x"]
    assert seen.sum() > 80
    x = radius * (made["phi1"] + made["phi2"]) / 2
    assert abs(made["x"] - x)[seen].max() < 0.039 * 3e-3  # by 3 ms at most


def test_corners_are_looked_for_when_they_are_passed(setup: Setup, wire: Wire) -> None:
    powered(wire, {120: 100, 121: 100})
    shape = replace(SMALL, loops=3)
    radius = setup.machine.parameters["pulley_radius"]
    made = execute_grbl(setup, order_of(shape))
    assert made is not None
    times = passing_times(made, shape, radius)
    assert times[-1] > 1.5 * shape.vertex_times[-1]
    x, y = radius / 2 * (made["phi1"] + made["phi2"]), radius / 2 * (made["phi1"] - made["phi2"])
    passed = np.column_stack([np.interp(times, made.time, axis) for axis in (x, y)])
    assert np.abs(passed - shape.vertices).max() < 3e-5  # three steps
    corners = corner_table(replace(made, channels={**made.channels, "x": x, "y": y}), shape, times)
    assert max(abs(corner.contour_error) for corner in corners) < 2e-5


def test_interrupted_homing_is_reset(setup: Setup, wire: Wire) -> None:
    powered(wire, {22: 1, 130: 160, 131: 120})

    def interrupt(wire: Wire) -> None:
        raise KeyboardInterrupt

    def when_homing(wire: Wire) -> None:
        wire.at.append((wire.now() + 0.05, interrupt if b"$H" in wire.sent else when_homing))

    wire.at.append((0.0, when_homing))
    with pytest.raises(KeyboardInterrupt):
        execute_grbl(replace(setup, centred=False, home=True), order_of(SMALL))
    assert wire.sent.endswith(b"$H\n\x18")


def test_a_held_controller_is_refused(setup: Setup, wire: Wire) -> None:
    wire.controller.write(b"!")
    with pytest.raises(InputError, match="state Hold, expected Idle"):
        execute_grbl(setup, order_of(SMALL))


def test_unplugged_while_connecting_is_one_line(setup: Setup, wire: Wire) -> None:
    wire.plugged = False
    with pytest.raises(InputError, match="wire: link lost"):
        execute_grbl(setup, order_of(SMALL))
    with pytest.raises(InputError, match="wire: link lost"):
        hil_grbl_watch.show_controller("wire", 0.5)


def test_a_soft_limit_keeps_the_place(
    setup: Setup, wire: Wire, capsys: pytest.CaptureFixture[str]
) -> None:
    def strike(wire: Wire) -> None:
        wire.controller.alarm(2)

    wire.at.append((1.5, strike))
    with pytest.raises(typer.Exit) as ended:
        execute_grbl(setup, order_of(SMALL))
    assert ended.value.exit_code == 3
    said = capsys.readouterr()
    assert "ALARM:2 (soft limit" in said.err
    assert "kept the carriage's place" in said.out
    hil_grbl_watch.show_controller("wire", 0.5)  # silent after the alarm: a reset wakes it
    assert "Alarm" in capsys.readouterr().out
