"""The frames of `firmware/protocol.h`: COBS(type u8, sequence u16, body, CRC-16), then 00."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag

from cobs import cobs
from fastcrc import crc16

VERSION = 2
SEGMENT = struct.Struct("<Hii")
_HEAD, _CRC = struct.Struct("<BH"), struct.Struct("<H")
_INFO, _STATUS = struct.Struct("<BBBBBIII"), struct.Struct("<BBBBHHBIiihhH")
_PONG, _REPLY = struct.Struct("<IIH"), struct.Struct("<BBHB")
CONFIG = struct.Struct("<4i4IHH")
PAIR, WORD = struct.Struct("<ii"), struct.Struct("<I")


class Type(IntEnum):
    """What a frame is."""

    HELLO, CONFIG, ARM, RUN, STOP, ESTOP, CLEAR = 1, 2, 3, 4, 5, 6, 7
    PING, BEAT, ORIGIN, RELEASE, GAINS, HOME, SEGMENTS = 8, 9, 10, 11, 12, 13, 0x10
    INFO, STATUS, PONG, REPLY = 0x81, 0x82, 0x83, 0x84


class State(IntEnum):
    """What the board does."""

    IDLE, ARMED, RUNNING, STOPPING, FAULT, HOMING = range(6)


class Cause(IntEnum):
    """Why the board stopped, or refused a frame."""

    NOTHING, BY_HOST, BY_ESTOP_FRAME, BY_ESTOP_PIN, BY_LIMIT_SWITCH, BY_WATCHDOG = range(6)
    BY_UNDERRUN, BY_POSITION, BY_RATE, BY_ACCELERATION, BY_REVERSAL, BY_ENCODER = range(6, 12)
    BY_COUNTS, BY_HOMING = 12, 13
    REFUSED_STATE, REFUSED_ORDER, REFUSED_FULL, REFUSED_FORM = range(14, 18)


class Flag(IntFlag):
    """Flags of a status."""

    POSITION_KNOWN, DRIVERS_ON, SWITCH_X, SWITCH_Y, ESTOP_OPEN = 0x01, 0x02, 0x10, 0x20, 0x40


ADVICE = {
    Cause.BY_HOST: "stopped by the host",
    Cause.BY_ESTOP_FRAME: "emergency stop by the host; centre the carriage, then --centred",
    Cause.BY_ESTOP_PIN: "emergency stop pressed; release it, centre the carriage, then --centred",
    Cause.BY_LIMIT_SWITCH: "limit switch hit; `corexy hil release`, centre by hand, then --centred",
    Cause.BY_WATCHDOG: "the board heard nothing from the host; check the cable, then run again",
    Cause.BY_UNDERRUN: "the host or link was too slow; see `corexy hil check`, then run again",
    Cause.BY_POSITION: "the motion leaves the stage; check the machine file and the start",
    Cause.BY_RATE: "faster than --max-speed allows; lower the speed",
    Cause.BY_ACCELERATION: "accelerates more than --max-accel and --max-jump allow",
    Cause.BY_REVERSAL: "a motor reversed without a pause; report this",
    Cause.BY_ENCODER: "a motor does not follow; check the encoder's wires and direction",
    Cause.BY_COUNTS: "an encoder ran faster than is counted, or an edge was missed; check its "
    "wires and direction, centre the carriage, then --centred",
    Cause.BY_HOMING: "homing found no switch on its way, or it did not close again; check the "
    "switches, and on which side they are (--at-x, --at-y)",
}


@dataclass(frozen=True)
class Info:
    """Who the board is: kind "S" or "D", queue [segments], clocks [Hz].

    ``fastest`` is the largest rate [2^-fraction_bits counts a tick] that it plays.
    """

    version: int
    kind: str
    queue: int
    reset_cause: int
    fraction_bits: int
    tick_hz: int
    cpu_hz: int
    fastest: int


@dataclass(frozen=True)
class Status:
    """State of the board at a tick; counts in steps or encoder counts, volts in V."""

    state: State
    fault: Cause
    flags: Flag
    free: int
    next_frame: int
    frames_bad: int
    bytes_lost: int
    tick: int
    counts: tuple[int, int]
    volts: tuple[float, float]
    longest: int


@dataclass(frozen=True)
class Pong:
    """Tick, and timer counts in it, at which the PING with that token ended."""

    token: int
    tick: int
    cycles: int


@dataclass(frozen=True)
class Reply:
    """Answer to a command; ``next_frame`` and ``free`` are the credits of the segment stream."""

    type: int
    code: Cause
    next_frame: int
    free: int


Message = Info | Status | Pong | Reply


def encode(kind: int, body: bytes = b"", sequence: int = 0) -> bytes:
    """One frame with its delimiter."""
    payload = _HEAD.pack(kind, sequence & 0xFFFF) + body
    return cobs.encode(payload + _CRC.pack(crc16.mcrf4xx(payload))) + b"\0"


def parse(payload: bytes) -> Message | None:
    """The message of a checked frame without its CRC; None for a type nobody knows."""
    kind, body = payload[0], payload[_HEAD.size :]
    try:
        if kind == Type.INFO:
            version, letter, *rest = _INFO.unpack(body)
            return Info(version, chr(letter), *rest)
        if kind == Type.STATUS:
            return _status(body)
        if kind == Type.PONG:
            return Pong(*_PONG.unpack(body))
        if kind == Type.REPLY:
            of, code, following, free = _REPLY.unpack(body)
            return Reply(of, Cause(code), following, free)
    except (struct.error, ValueError):  # another version of the firmware
        return None
    return None


def _status(body: bytes) -> Status:
    state, fault, flags, free, following, bad, lost, tick, a, b, u, v, longest = _STATUS.unpack(
        body
    )
    volts = (u / 1000, v / 1000)
    return Status(
        State(state), Cause(fault), Flag(flags), free, following, bad, lost, tick, (a, b), volts,
        longest,
    )  # fmt: skip


class Decoder:
    """Bytes in, messages out; ``bad`` counts frames that were none, ``size`` all bytes."""

    def __init__(self) -> None:
        self._waiting = bytearray()
        self.good = self.bad = self.size = 0

    def feed(self, data: bytes) -> list[Message]:
        """The messages that these bytes complete."""
        self._waiting += data
        self.size += len(data)
        *frames, rest = bytes(self._waiting).split(b"\0")
        self._waiting = bytearray(rest[-256:])  # no frame is longer
        return [message for frame in frames if frame and (message := self._message(frame))]

    def _message(self, frame: bytes) -> Message | None:
        try:
            payload = cobs.decode(frame)
        except cobs.DecodeError:
            payload = b""
        whole = len(payload) >= _HEAD.size + _CRC.size and crc16.mcrf4xx(payload) == 0
        message = parse(payload[: -_CRC.size]) if whole else None
        self.good += message is not None
        self.bad += message is None
        return message
