"""The conversation with a GRBL controller: lines, realtime characters, who answers and what."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from corexy_fmi.errors import InputError
from corexy_fmi.hil import grbl_words
from corexy_fmi.hil.grbl_report import BANNER, INCH, Build, Family, Report, build, report, settings
from corexy_fmi.hil.port import Port

BAUD = 115_200
POLL, QUICK = 0.2, 0.05  # [s] between two `?`: while it moves, as GRBL asks for; while it stands
BOOT, PATIENCE = 4.0, 3.0  # [s] for a bootloader; for an answer
DEAF = 0.6  # [s] after an alarm in which GRBL swallows a reset (it waits 0.5 s, then forgets it)
STATUS, HOLD, RESET, FULL_FEED = b"?", b"!", b"\x18", b"\x90"
READY = ("Idle", "Alarm")  # states in which it answers lines and does not move
ASKS = 40  # reports until the work offset must have come: GRBL gives it in every 10th or 30th


@dataclass(frozen=True)
class Heard:
    """A report with the host's times [s] at which it was asked for and had arrived."""

    sent: float
    heard: float
    report: Report


@dataclass
class Link:
    """One controller.  ``replies`` are the codes of lines in their order, 0 for ok."""

    port: Port
    build: Build | None = None
    settings: dict[int, float] = field(default_factory=dict)
    replies: deque[int] = field(default_factory=deque)
    last: Heard | None = None
    offset: tuple[float, float] | None = None
    alarm: int = 0
    restarts: int = 0
    heard_at: float = -1e9
    _lines: list[str] = field(default_factory=list)
    _rest: bytes = b""
    _asked: float | None = None
    _alarm_at: float = -1e9

    @property
    def family(self) -> Family:
        """Whose firmware it is, as far as is known."""
        return Family.GRBL if self.build is None else self.build.family

    def poll(self, wait: float = 1e-3) -> list[Heard]:
        """Take what has arrived; waits at most ``wait`` [s]; the reports among it."""
        data = self.port.read(wait)
        now = self.port.now()
        if data:
            self.heard_at = now
        *lines, self._rest = (self._rest + data).replace(b"\r", b"").split(b"\n")
        found = [self._take(line.decode("latin-1").strip(), now) for line in lines]
        return [one for one in found if one is not None]

    def _take(self, line: str, now: float) -> Heard | None:
        said = report(line, INCH if self.settings.get(13) else 1.0)
        if said is not None:
            self.offset = said.offset or self.offset
            self.last = Heard(now if self._asked is None else self._asked, now, said)
            self._asked = None
            return self.last
        word, _, code = line.partition(":")
        if line == "ok" or (word == "error" and code.isdigit()):
            self.replies.append(0 if line == "ok" else int(code))
        elif word == "ALARM" and code.isdigit():
            self.alarm, self._alarm_at = int(code), now
        elif line:
            self.restarts += bool(BANNER.match(line))
            self._lines.append(line)
        return None

    def ask(self, every: float = POLL) -> None:
        """A `?`, where one is due; one that stayed without an answer is asked again after 1 s."""
        now = self.port.now()
        since = now - (self._asked if self._asked is not None else -1e9)
        due = self.last is None or now - self.last.sent >= every
        if since > 1.0 and due:
            self._asked = now
            self.port.write(STATUS)

    def fresh(self, every: float = QUICK, wait: float = PATIENCE) -> Heard:
        """The next report; raises InputError where none comes."""
        before, deadline = self.last, self.port.now() + wait
        while self.port.now() < deadline:
            self.ask(every)
            self.poll()
            if self.last is not None and self.last is not before:
                return self.last
        raise InputError("controller: no answer to `?`, check power and cable")

    def command(self, line: str, wait: float = PATIENCE) -> list[str]:
        """A line and what came before its ok; raises InputError for error, alarm and silence."""
        self.replies.clear()
        self._lines.clear()
        self.alarm = 0
        self.port.write(f"{line}\n".encode())
        deadline = self.port.now() + wait
        while not self.replies and not self.alarm and self.port.now() < deadline:
            self.poll()
        if self.alarm:
            raise InputError(f"controller: {line}: {grbl_words.alarm(self.alarm, self.family)}")
        if not self.replies:
            raise InputError(f"controller: no answer to {line!r}, expected ok")
        if code := self.replies.popleft():
            raise InputError(f"controller: {line}: {grbl_words.error(code, self.family)}")
        return list(self._lines)

    def connect(self) -> Build:
        """Who is there and how it is set; moves nothing.  Raises InputError for a stranger.

        A controller that stays silent, as GRBL does after a limit alarm, gets one soft reset.
        """
        if not self._awake(BOOT):
            self.reset()
            self.listen()
        assert self.last is not None
        if self.last.report.state == "Sleep":
            self.reset()
            self.listen()
        if (state := self.last.report.state) not in READY:
            raise InputError(f"controller: state {state}, expected Idle: stop its other user first")
        self._lines, banner = [], [line for line in self._lines if BANNER.match(line)]
        self.port.write(b"\n")  # ends what an earlier user left half said
        self._quiet()
        self.build = build([*banner, *self.command("$I")])
        self.settings = settings(self.command("$$"))
        return self.build

    def listen(self) -> None:
        """Until it reports, whatever it does; raises InputError for a stranger."""
        if not self._awake(BOOT):
            heard = "nothing" if self.heard_at < 0 else "something else"
            raise InputError(f"port: heard {heard}, expected a GRBL controller at {BAUD} baud")

    def _awake(self, wait: float) -> bool:
        deadline = self.port.now() + wait
        self.last = None
        while self.last is None and self.port.now() < deadline:
            self.ask()
            self.poll()
        return self.last is not None

    def _quiet(self, silence: float = 0.1) -> None:
        """Until nothing more comes."""
        until = self.port.now() + silence
        while self.port.now() < until:
            if self.poll() or self.heard_at > until - silence:
                until = self.port.now() + silence

    def locate(self) -> tuple[float, float]:
        """Where the controller thinks it stands [mm], in machine coordinates, and its offset heard.

        Raises InputError where it does not say.
        """
        for _ in range(ASKS):
            place = self.fresh().report.place(self.offset)
            if place is not None and self.offset is not None:
                return place
        raise InputError("controller: no WCO in its reports, expected $10=1 or $10=255")

    def reset(self) -> bool:
        """Soft reset, held back while GRBL is deaf to it; whether the banner came."""
        for _ in range(2):
            while self.port.now() - self._alarm_at < DEAF:
                self.poll(0.01)
            before, deadline = self.restarts, self.port.now() + 2.0
            self.port.write(RESET)
            while self.port.now() < deadline:
                self.poll(0.01)
                if self.restarts > before:
                    self._asked = None
                    self.replies.clear()
                    return True
        return False
