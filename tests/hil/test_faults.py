"""Faults on the emulated board: motion ends in time, counts agree, the recording is whole."""

from __future__ import annotations

import numpy as np
import pytest

from tests.hil.faults import CASES, KILOBYTES, Outcome, play, stranger

CASE = {case.name: case for case in CASES}
WATCHDOG = 200.0 + 5.0  # [ms] with the ramp


def outcome(name: str) -> Outcome:
    return play(CASE[name])


@pytest.mark.parametrize(
    "name",
    [
        "1 % of bytes flipped",
        "1 % of bytes lost",
        "5 % of bytes flipped",
        "5 % of bytes lost",
        "frames duplicated",
        "frames delayed",
        "garbage on the line",
    ],
)
def test_a_bad_link_costs_no_step(name: str) -> None:
    o = outcome(name)
    assert o.complete
    assert o.position_kept
    assert o.frames_bad + o.sent_again > 0 or name == "frames duplicated"


@pytest.mark.parametrize("name", ["unplugged for 1 s", "host paused 1 s", "host killed"])
def test_a_silent_host_stops_the_board(name: str) -> None:
    o = outcome(name)
    assert 0 < o.last_step < WATCHDOG
    assert o.position_kept
    assert o.known
    assert o.rows > 50


@pytest.mark.parametrize("name", ["e-stop pressed", "e-stop frame"])
def test_emergency_stop(name: str) -> None:
    o = outcome(name)
    assert o.last_step < 2.0
    assert o.drivers_off
    assert o.position_kept  # the counts; the carriage may have slipped
    assert not o.known
    assert "--centred" in o.trouble


def test_limit_switch_stops_at_once() -> None:
    o = outcome("limit switch")
    assert o.last_step < 1.0
    assert o.position_kept
    assert not o.known


def test_reset_is_noticed() -> None:
    o = outcome("board reset")
    assert o.last_step < 1.0
    assert o.drivers_off
    assert not o.known
    assert "reset" in o.trouble


def test_interrupt_ramps_down() -> None:
    o = outcome("Ctrl-C")
    assert 0 < o.last_step < 50
    assert o.position_kept
    assert o.known
    assert not o.drivers_off


def test_full_disk_stops_and_keeps_what_is_written() -> None:
    o = outcome("full disk")
    assert o.last_step < 50
    assert o.position_kept
    assert "cannot be written" in o.trouble
    assert 40 * o.rows < KILOBYTES * 1024


def test_another_device_is_told() -> None:
    assert "bytes of something else" in stranger()


def test_recording_reaches_to_the_stop() -> None:
    assert np.isclose(outcome("e-stop pressed").last_row, 1.0, atol=0.05)
