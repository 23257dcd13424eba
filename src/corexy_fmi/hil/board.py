"""A board at a port: commands with answers, reports as they come, and its clock."""

from __future__ import annotations

from collections.abc import Callable

from corexy_fmi.errors import InputError
from corexy_fmi.hil.clock import Clock
from corexy_fmi.hil.limits import Limits
from corexy_fmi.hil.port import Port
from corexy_fmi.hil.protocol import (
    ADVICE,
    PAIR,
    VERSION,
    WORD,
    Cause,
    Decoder,
    Flag,
    Info,
    Message,
    Pong,
    Reply,
    State,
    Status,
    Type,
    encode,
)

PATIENCE, TRIES = 0.04, 20  # [s] until a command is sent again, and how often
BEAT, PING = 0.02, 0.1  # [s] between frames that keep the watchdog content, and clock samples
BOOT = 3.0  # [s] a bootloader may hold the board


class Board:
    """One board.  ``listeners`` hear every message with the host's time [s] of its arrival."""

    def __init__(self, port: Port) -> None:
        self.port = port
        self.decoder = Decoder()
        self.clock = Clock()
        self.info: Info | None = None
        self.status: Status | None = None
        self.restarts = 0
        self.listeners: list[Callable[[Message, float], None]] = []
        self._replies: list[Reply] = []
        self._last_sent = self._last_ping = -1e9
        self._pings: dict[int, float] = {}
        self._token = 0

    def poll(self, wait: float = 1e-3) -> list[Message]:
        """Take what has arrived; waits at most ``wait`` [s] for it."""
        data = self.port.read(wait)
        now = self.port.now()
        messages = self.decoder.feed(data)
        for message in messages:
            self._take(message, now)
            for listener in self.listeners:
                listener(message, now)
        return messages

    def _take(self, message: Message, now: float) -> None:
        if isinstance(message, Status):
            self.status = message
        elif isinstance(message, Reply):
            self._replies.append(message)
        elif isinstance(message, Info):
            self.restarts += self.info is not None
            self.info = message
            self.clock.tick_hz = message.tick_hz
        elif isinstance(message, Pong) and message.token in self._pings:
            sent = self._pings.pop(message.token)
            self.clock.add(sent, now, message.tick + self._share(message))

    def _share(self, pong: Pong) -> float:
        """Part of a tick; a dc board counts it in units of 64 cycles."""
        if self.info is None:
            return 0.0
        prescale = 64 if self.info.kind == "D" else 1
        return pong.cycles * prescale * self.info.tick_hz / self.info.cpu_hz

    def send(self, kind: Type, body: bytes = b"", sequence: int = 0) -> None:
        """One frame out."""
        self.port.write(encode(kind, body, sequence))
        self._last_sent = self.port.now()

    def keep_alive(self) -> None:
        """A beat and a clock sample, where one is due."""
        now = self.port.now()
        if now - self._last_ping >= PING:
            self._last_ping = now
            self._token += 1
            self._pings = {self._token: now}
            self.send(Type.PING, WORD.pack(self._token))
        elif now - self._last_sent >= BEAT:
            self.send(Type.BEAT)

    def request(self, kind: Type, body: bytes = b"") -> Cause:
        """A command until it is answered; raises InputError where no answer comes."""
        for _ in range(TRIES):
            self._replies.clear()
            self.send(kind, body)
            deadline = self.port.now() + PATIENCE
            while self.port.now() < deadline:
                self.keep_alive()  # an answer that gets lost may take longer than the watchdog
                self.poll()
                for reply in self._replies:
                    if reply.type == kind:
                        return reply.code
        raise InputError(f"board: no answer to {kind.name}, expected the firmware of this project")

    def command(self, kind: Type, body: bytes = b"") -> None:
        """A command that must be taken; raises InputError that says why it was not."""
        code = self.request(kind, body)
        if code is not Cause.NOTHING:
            state = self.status.state.name.lower() if self.status else "unknown"
            raise InputError(f"board refused {kind.name} while {state}: "
                             f"{ADVICE.get(code, code.name.lower())}")  # fmt: skip

    def connect(self) -> Info:
        """Wait for the board and check who it is; raises InputError for silence or a stranger."""
        deadline = self.port.now() + BOOT
        self.info = None
        while self.port.now() < deadline:
            self.send(Type.HELLO)
            again = self.port.now() + PATIENCE
            while self.port.now() < again:
                self.poll()
                if self.info and self.status:
                    return self._checked(self.info)
        size = self.decoder.size
        heard = f"{size} bytes of something else" if size else "nothing"
        raise InputError(f"port: heard {heard}, expected this project's firmware at 500000 baud "
                         "(`make flash PORT=...` writes it)")  # fmt: skip

    def _checked(self, info: Info) -> Info:
        self.restarts = 0
        if info.version != VERSION:
            raise InputError(f"board: protocol {info.version}, expected {VERSION}: "
                         "`make flash PORT=...` writes the firmware of this version")  # fmt: skip
        return info

    def fresh_status(self) -> Status:
        """The next report; raises InputError where none comes."""
        self.status = None
        deadline = self.port.now() + 1.0
        while self.port.now() < deadline:
            self.keep_alive()
            self.poll()
            if self.status is not None:
                return self.status
        raise InputError("board: no reports, expected one every 10 ms")

    def configure(self, limits: Limits) -> None:
        """Out of any earlier fault, limits set; the drivers stay as they are.

        Raises InputError where the board moves or its e-stop is open.
        """
        status = self.fresh_status()
        if status.state in (State.RUNNING, State.STOPPING, State.HOMING):
            raise InputError("board: it moves; stop its other user first")
        self.command(Type.CLEAR)
        self.command(Type.CONFIG, limits.pack())

    def located(self, centred: bool) -> Status:
        """Where it stands; raises InputError where nobody said."""
        if centred:
            self.command(Type.ORIGIN, PAIR.pack(0, 0))
        status = self.fresh_status()
        if not status.flags & Flag.POSITION_KNOWN:
            raise InputError("board: nobody knows where the carriage stands; add --home, or move "
                             "it to the centre by hand and add --centred")  # fmt: skip
        return status
