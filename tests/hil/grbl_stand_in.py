"""A stand-in for a GRBL 1.1 controller, from its documents and source: bytes in, bytes out, time.

Faithful: receive ring of 128 bytes that drops what does not fit, realtime characters picked off,
ok/error for each line, planner of 16 blocks that blocks the reader, alarm lock, a reset swallowed
for half a second after an alarm, silence after a limit alarm and while homing, steps as GRBL rounds
them.  As grblHAL or FluidNC it has their buffers, settings, reports, alarms (`grbl_firmware.py`).
Not modelled: 10 ms pieces of ramps, noise, USB, overrides, spindle, z, arcs.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from tests.hil.grbl_code import Reader, Rest, Way
from tests.hil.grbl_firmware import GRBL, SETTINGS, Firmware
from tests.hil.grbl_motion import TICK, Motion

LINE = 79  # [bytes] of a line
BYTE = 10 / 115_200  # [s] on the wire
BUSY = 2e-3  # [s] to parse and plan a line
DELAY = 0.5  # [s] GRBL waits after an alarm
HOMING = 0.4  # [s] of its cycle here
SOFT, ABORT = 2, 3


@dataclass
class StandIn:
    """One controller, powered up."""

    firmware: Firmware = GRBL
    settings: dict[int, float] = field(default_factory=dict)
    offset: tuple[float, float] = (0.0, 0.0)  # WCO [mm]
    overflowed: int = 0  # bytes that found no room
    lines: int = 0
    fullest: int = 0
    state: str = "Idle"
    reports: int = 0

    def __post_init__(self) -> None:
        self.settings = SETTINGS | self.settings
        self.motion = Motion(self.settings, self.firmware.blocks)
        self._wire: deque[int] = deque()
        self._ring: deque[int] = deque()
        self._out = bytearray()
        self._line = ""
        self._waiting: tuple[str, float] | None = None
        self._busy = self._deaf = 0.0
        self._credit = 0.0
        self._critical = self._clears = False
        self._wants_report = False
        self._reader = Reader()
        self._alarm = self.firmware.unhomed
        if self.settings[22]:
            self.state = "Alarm"
        self._welcome()

    # the wire

    def write(self, data: bytes) -> None:
        """Bytes sent to it; they arrive at the speed of the wire."""
        self._wire.extend(data)

    def read(self) -> bytes:
        """What it has said."""
        data, self._out = bytes(self._out), bytearray()
        return data

    @property
    def time(self) -> float:
        """[s] since power-up."""
        return self.motion.time

    def advance(self, seconds: float) -> None:
        """Live on."""
        for _ in range(max(round(seconds / TICK), 1)):
            self.motion.advance(TICK)
            self._credit = min(self._credit + TICK, 10 * BYTE) if self._wire else 0.0
            while self._wire and self._credit >= BYTE:
                self._credit -= BYTE
                self._receive(self._wire.popleft())
            self._serve()

    def _receive(self, byte: int) -> None:
        if byte == 0x18:
            self._reset()
        elif byte == ord("?"):
            self._wants_report = True
        elif byte == ord("!"):
            self._hold("Hold")
        elif byte == ord("~"):
            self._resume()
        elif byte > 0x7F:
            if byte == 0x84:
                self._hold("Door")
        elif len(self._ring) >= self.firmware.ring:
            self.overflowed += 1
        else:
            self._ring.append(byte)
            self.fullest = max(self.fullest, len(self._ring))

    def _say(self, line: str) -> None:
        self._out += f"{line}\r\n".encode()

    def _welcome(self) -> None:
        self._say(f"\r\n{self.firmware.banner}")
        if self.state == "Alarm":
            self._say("[MSG:'$H'|'$X' to unlock]")
            if self._alarm:
                self._say(f"ALARM:{self._alarm}")

    # realtime

    def _reset(self) -> None:
        if self.time < self._deaf and not self._clears:
            return  # the flag is cleared when the delay is over
        moving = self.motion.running or self.state == "Home"
        self._ring.clear()
        self._line, self._waiting, self._critical = "", None, False
        self.motion.clear()
        self._reader = Reader()
        if moving:
            self.state = "Alarm"
            self._say(f"ALARM:{ABORT}")
            self._deaf = self._busy = self.time + DELAY
            self._clears = False
            self._waiting = "welcome", self._deaf
            return
        self.state = "Alarm" if self.state in ("Alarm", "Sleep") else "Idle"
        self._welcome()

    def _hold(self, state: str) -> None:
        if self.state in ("Run", "Idle", "Hold") and not self._critical:
            if state == "Door":
                self._say("[MSG:Check Door]")
            self.state = state
            self.motion.holding = True

    def _resume(self) -> None:
        if self.state in ("Hold", "Door") and not self.motion.running:
            self.motion.holding = False
            self.state = "Idle"

    def alarm(self, code: int) -> None:
        """A limit switch or a soft limit: everything stands, and waits for a reset."""
        self.motion.clear()
        self.state, self._critical, self._alarm = "Alarm", True, code
        self._say(f"ALARM:{code}")
        if self.firmware.talks:
            self._say("[MSG:Reset to continue]")
            return
        self._deaf = self._busy = self.time + DELAY
        self._clears = False
        self._waiting = "critical", self._deaf

    def _report(self) -> None:
        state = self.state
        if state in ("Hold", "Door"):
            state += ":1" if self.motion.running else ":0"
        if state == "Idle" and self.motion.running:
            state = "Run"
        if state == "Alarm" and self.firmware.substate:
            state += f":{self._alarm}"
        x, y = self.motion.xy
        kind = "MPos" if int(self.settings[10]) & 1 else "WPos"
        if kind == "WPos":
            x, y = x - self.offset[0], y - self.offset[1]
        words = [state, f"{kind}:{x:.3f},{y:.3f},0.000"]
        if int(self.settings[10]) & 2:
            words.append(f"Bf:{self.motion.usable - len(self.motion.blocks)},"
                         f"{self.firmware.ring - len(self._ring)}")  # fmt: skip
        words.append(f"FS:{60 * self.motion.speed:.0f},0")
        if self.reports % (30 if self.motion.running else 10) == 0:
            words.append(f"WCO:{self.offset[0]:.3f},{self.offset[1]:.3f},0.000")
        self.reports += 1
        tail = self.firmware.tail if self.reports % 10 == 1 else ""
        self._say(f"<{'|'.join(words)}{tail}>")

    # the main program

    def _serve(self) -> None:
        if self._waiting is not None and not self._woken():
            return
        mute = self._critical or self.state == "Home"
        if self._wants_report and (self.firmware.talks or not mute):
            self._wants_report = False
            self._report()
        stuck = self._critical and not self.firmware.talks
        if self.state in ("Hold", "Door", "Sleep") or stuck or self.time < self._busy:
            return
        while self._ring and self._waiting is None and self.time >= self._busy:
            self._character(chr(self._ring.popleft()))
        if self.motion.blocks and (not self._ring or self.motion.full()):
            self.motion.running = True
        self.state = "Run" if self.motion.running else ("Idle" if self.state == "Run" else
                                                        self.state)  # fmt: skip

    def _woken(self) -> bool:
        """Whether what the main program waits for has come; reports are given meanwhile."""
        assert self._waiting is not None
        why, until = self._waiting
        asked = why in ("room", "rest", "dwell") or (why == "home" and self.firmware.talks)
        if asked and self._wants_report:
            self._wants_report = False
            self._report()
        if self.state in ("Hold", "Door"):
            return False
        if why in ("room", "rest") and self.motion.blocks:
            self.motion.running = True
            self.state = "Run"
        if why == "room" and self.motion.full():
            return False
        if why == "rest":
            if self.motion.blocks:
                return False
            self.state = "Idle"
            self._waiting = "dwell", self.time + until
            return False
        if self.time < until:
            return False
        self._waiting = None
        return self._wake(why)

    def _wake(self, why: str) -> bool:
        if why == "room":
            self._line, line = "", self._line
            self._answer(self._execute(line))
        elif why == "dwell":
            self._say("ok")
        elif why == "home":
            pull = round(self.settings[27] * self.settings[100])
            self.motion.place(-pull, -pull)
            self.state, self._alarm = "Idle", 0
            self._say("ok")
        elif why == "welcome":
            self._welcome()
        elif why == "critical":
            self._say("[MSG:Reset to continue]")
            self._clears = True
        return True

    def _character(self, letter: str) -> None:
        if letter in "\r\n":
            self._busy = self.time + BUSY
            line, self._line = self._line, ""
            self.lines += 1
            self._answer(self._execute(line) if len(line) <= LINE else 11)
        elif letter > " ":
            self._line += letter.upper()

    def _answer(self, code: int | None) -> None:
        if code is not None:
            self._say("ok" if code == 0 else f"error:{code}")

    def _execute(self, line: str) -> int | None:
        """Its code; None where the answer comes later."""
        if self._critical and line[:2] not in ("$I", "$$", "$G"):
            return self.firmware.critical
        if line.startswith("$"):
            return self._system(line)
        if not line:
            return 0
        return 9 if self.state == "Alarm" else self._block(line)

    def _system(self, line: str) -> int | None:
        if line == "$I":
            for text in self.firmware.info:
                self._say(text)
        elif line == "$G":
            self._say("[GC:G1 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]")
        elif self.state not in ("Idle", "Alarm"):
            return 8
        elif line == "$$":
            tells = self.firmware.tells
            for number, value in sorted(self.settings.items()):
                if tells is not None and number not in tells:
                    continue
                self._say(f"${number}={value:.3f}" if number > 99 else f"${number}={value:g}")
        elif line == "$X":
            self.state = "Idle"
            self._say("[MSG:Caution: Unlocked]")
        elif line == "$H":
            if not self.settings[22]:
                return 5
            self.state, self._waiting = "Home", ("home", self.time + HOMING)
            return None
        elif line == "$SLP":
            self.state = "Sleep"
        else:
            return 3
        return 0

    def _block(self, line: str) -> int | None:
        said = self._reader.read(line)
        if isinstance(said, int):
            return said
        if isinstance(said, Rest):
            self._waiting = "rest", said.seconds
            return None
        if self.motion.full():
            self._line, self._waiting = line, ("room", 0.0)
            return None
        place = self._target(said)
        if self.settings[20] and any(not -self.settings[130 + m] <= p <= 0
                                     for m, p in enumerate(place)):  # fmt: skip
            self.alarm(SOFT)
            return None
        factor = 2**0.5 if self.firmware.head_feed else 1.0  # its source: in G93 as well
        self.motion.add(*place, said.feed / 60 * factor, said.inverse)
        return 0

    def _target(self, way: Way) -> tuple[float, float]:
        """Machine position [mm]."""
        here = [p / self.settings[100] for p in self.motion.planned]
        base = here if way.relative else self.offset
        x, y = (h if w is None else b + w for h, b, w in zip(here, base, way.to, strict=True))
        return x, y
