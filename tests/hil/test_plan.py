"""Segments, clocks and tracker lines, without any board."""

from __future__ import annotations

import numpy as np
import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.hil.clock import Clock, lower_envelope
from corexy_fmi.hil.limits import Allowed, Limits, Scale
from corexy_fmi.hil.loop import Gains
from corexy_fmi.hil.protocol import SEGMENT, Decoder, Info, Pong, Type, encode
from corexy_fmi.hil.segments import END, check, plan
from corexy_fmi.hil.tracker import Tracker, open_lines
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import command
from corexy_fmi.rectangle import Rectangle
from tests.hil.kit import step_ticks

INFO = Info(2, "S", 64, 0, 32, 25_000, 16_000_000, (1 << 31) - 1)
MACHINE = load_machine("yin2018")
SCALE = Scale.of(INFO, MACHINE, 3200)


def rectangle(accel: float | None = None, speed: float = 0.039):
    order = command(Rectangle(0.02, 0.014, speed, 1, accel).motion, SCALE.radius)
    return order, np.column_stack([order["phi1"], order["phi2"]])


def counts_at(angles) -> tuple[int, int]:
    a, b = np.rint(angles * 3200 / (2 * np.pi)).astype(int).tolist()
    return a, b


@pytest.mark.parametrize("accel", [None, 1.0])
def test_plan_follows_the_command(accel: float | None) -> None:
    order, angles = rectangle(accel)
    made = plan(order.time, angles, SCALE, counts_at(angles[0]))
    for m in (0, 1):
        wanted = np.interp(order.time, made.time, made.angles[:, m])
        steps = np.abs(wanted - angles[:, m]) * 3200 / (2 * np.pi)
        inner = steps[20:]  # the start is at a whole count
        assert inner.max() < 0.25 + 7.8 * 3200 / (2 * np.pi) * 3 * 40e-6  # and two ticks of a turn


def test_steps_add_up_to_the_counts() -> None:
    order, angles = rectangle(1.0)
    begin = counts_at(angles[0])
    made = plan(order.time, angles, SCALE, begin)
    for m, start in enumerate(begin):
        ticks, signs = step_ticks(made, m)
        assert start + signs.sum() == made.counts[m]
        assert np.all(np.diff(ticks) >= 2)
    assert made.segments[-1] == END


def test_no_motor_turns_without_a_pause() -> None:
    order, angles = rectangle()
    made = plan(order.time, angles, SCALE, counts_at(angles[0]))
    for before, after in zip(made.segments, made.segments[1:], strict=False):
        assert before.rate1 * after.rate1 >= 0
        assert before.rate2 * after.rate2 >= 0


@pytest.mark.parametrize(
    ("allowed", "words"),
    [
        (Allowed(speed=0.02), "--max-speed"),
        (Allowed(jump=0.01, acceleration=0.1), "--max-jump"),
    ],
)
def test_what_the_board_would_refuse_is_said_before(allowed: Allowed, words: str) -> None:
    order, angles = rectangle()
    made = plan(order.time, angles, SCALE, counts_at(angles[0]))
    with pytest.raises(InputError, match=words):
        check(made, Limits.of(MACHINE, SCALE, allowed))


def test_stage_is_the_limit() -> None:
    time, far = np.array([0.0, 10.0]), np.array([[0.0, 0.0], [40.0, 0.0]])
    made = plan(time, far, SCALE, (0, 0))
    with pytest.raises(InputError, match="leaves the stage"):
        check(made, Limits.of(MACHINE, SCALE, Allowed()))


def test_decoder_finds_frames_in_noise() -> None:
    frame = encode(Type.PONG, (7).to_bytes(4, "little") + (9).to_bytes(4, "little") + b"\1\0", 3)
    broken = bytes([frame[0] ^ 1]) + frame[1:]
    decoder = Decoder()
    assert decoder.feed(b"noise\0" + frame[:5]) == []
    assert decoder.feed(frame[5:] + broken) == [Pong(7, 9, 1)]
    assert (decoder.good, decoder.bad) == (1, 2)


@pytest.mark.parametrize("apart", [1.0, 2.7, 4.0, 9.0])
def test_rows_may_be_seconds_apart_where_a_motor_turns(apart: float) -> None:
    scale = Scale(3200, 1 << 32, 5e-3, 1 / 25_000)
    angles = np.array([[0.0, 0.0], [1.0, 0.5], [0.5, 0.5], [0.8, 0.0]])
    made = plan(apart * np.arange(4), angles, scale, (0, 0))
    assert all(len(SEGMENT.pack(*segment)) for segment in made.segments)  # 16 bits hold its ticks
    assert made.counts == pytest.approx(angles[-1] * 3200 / (2 * np.pi), abs=1)
    assert made.ticks[-1] == pytest.approx(3 * apart * 25_000, abs=4)


def test_clock_finds_offset_and_drift() -> None:
    rng, clock = np.random.default_rng(0), Clock(25_000)
    for host in np.arange(0, 60, 0.1):
        trip = 1e-3 + rng.exponential(2e-3)
        clock.add(host, host + trip, ((host + trip / 2 + 5.0) * (1 + 50e-6)) * 25_000)
    offset, rate = clock.fit()
    assert rate - 1 == pytest.approx(50e-6, abs=5e-6)
    assert offset + rate * 30 == pytest.approx(35 * (1 + 50e-6), abs=3e-4)


def test_clock_goes_on_beyond_its_wrap() -> None:
    clock = Clock(25_000)
    ticks = [clock.unwrapped((2**32 - 50 + 20 * k) % 2**32) for k in range(10)]
    assert np.all(np.diff(ticks) == 20)
    assert clock.unwrapped(2**32 - 10) == 2**32 - 10  # an older stamp


def test_one_way_stamps_find_the_least_latency() -> None:
    rng, sent = np.random.default_rng(1), np.arange(0, 120, 0.025)
    heard = 77.0 + sent * (1 + 30e-6) + 4e-3 + rng.exponential(3e-3, len(sent))
    offset, rate = lower_envelope(sent, heard)
    assert rate - 1 == pytest.approx(30e-6, abs=5e-6)
    assert offset + rate * 60 == pytest.approx(77.0 + 60 * (1 + 30e-6) + 4e-3, abs=5e-4)


def test_tracker_takes_lines_however_they_are_cut() -> None:
    pieces = [b"0.0 1 2\n0.1,3", b",4\nrubbish\n0.1 5 6\n0.2 nan 1\n", b"0.3 7 8\n"]

    class Lines:
        def read(self) -> bytes:
            return pieces.pop(0) if pieces else b""

    tracker = Tracker(Lines())
    for now in (10.0, 10.1, 10.3):
        tracker.poll(now)
    assert [s[1:] for s in tracker.samples] == [(0.0, 1.0, 2.0), (0.1, 3.0, 4.0), (0.3, 7.0, 8.0)]
    assert tracker.bad == 3
    time, places = tracker.aligned()
    assert time == pytest.approx([10.0, 10.1, 10.3])
    assert places.shape == (3, 2)


@pytest.mark.parametrize("address", ["udp://:70000", "udp://:x", "udp://9000"])
def test_an_address_that_is_none_is_told(address: str) -> None:
    with pytest.raises(InputError, match="expected udp://host:port or a serial port"):
        open_lines(address)


@pytest.mark.parametrize("supply", [0.5, 33.0, 60.0])
def test_a_supply_that_the_firmware_cannot_tell_is_refused(supply: float) -> None:
    scale = Scale(4000, 1 << 32, 5e-3, 1e-3)
    with pytest.raises(InputError, match="expected 1 to 32 V"):
        Gains.of(load_machine("yin2018_dc"), scale, supply)
