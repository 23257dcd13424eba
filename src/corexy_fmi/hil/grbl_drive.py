"""One program on a GRBL controller: streamed by character counting, watched, stopped in order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from corexy_fmi.errors import InputError
from corexy_fmi.hil import grbl_words
from corexy_fmi.hil.grbl_link import HOLD, RESET, Heard, Link
from corexy_fmi.hil.grbl_report import BUFFER
from corexy_fmi.hil.port import LinkLostError
from corexy_fmi.hil.tracker import Tracker

SILENT = 2.0  # [s] without a byte, though asked at 5 Hz
HELD = 5.0  # [s] within which a feed hold must stand
RECONNECT = 5.0  # [s] to wait for a port that went away
STATES = {  # of a run, and what ends it
    "Run": "",
    "Idle": "",
    "Hold": "feed hold pressed at the controller",
    "Door": "safety door open",
}


@dataclass
class Log:
    """What happened: every report, when lines were answered [s], what went wrong.

    ``place`` [mm] is where the controller thinks it stands, if that means anything (``known``).
    """

    reports: list[Heard] = field(default_factory=list)
    answered: list[float] = field(default_factory=list)
    trouble: str = ""
    place: tuple[float, float] | None = None
    known: bool = True
    most: int = 0


class Drive:
    """Streams lines to a connected controller.

    The last one must be a rest (G4): it is answered when all before it has been driven.

    ``watch`` is called between two looks at the port; what it raises stops the motion by a feed
    hold.  KeyboardInterrupt does the same; a second one resets at once.
    """

    def __init__(
        self, link: Link, lines: Sequence[str], tracker: Tracker | None = None,
        watch: Callable[[Drive], None] | None = None,
    ) -> None:  # fmt: skip
        if link.build is None:
            raise InputError("controller: not connected")
        self.link, self.tracker, self.log = link, tracker, Log()
        self.lines = [f"{line}\n".encode() for line in lines]
        self._watch = watch
        self._room = min(link.build.buffer, BUFFER) - 1  # more would only outlive a lost host
        self._out: deque[int] = deque()
        self._sent = 0

    @property
    def answered(self) -> int:
        """Lines that the controller has taken."""
        return len(self.log.answered)

    def run(self) -> Log:
        """To the end, or to a stop; the log says which.  Raises nothing that the log can say."""
        log, link = self.log, self.link
        link.replies.clear()
        link.alarm, link.heard_at = 0, link.port.now()
        boot = link.restarts
        try:
            while self.answered < len(self.lines):
                self._look(boot)
            self._stand()
        except LinkLostError as error:
            log.trouble = (f"link lost ({error}): the controller plays the moves it holds, then "
                           "stands; plug it in again")  # fmt: skip
            self._reconnect()
        except KeyboardInterrupt:
            log.trouble = "interrupted"
            self._stop()
        except (InputError, OSError) as error:
            log.trouble = str(error)
            self._stop()
        except BaseException:  # also SIGTERM: the controller has no watchdog
            self._stop()
            raise
        return log

    def _look(self, boot: int) -> None:
        """Once around: lines out, replies and reports in, the tracker read."""
        self._pump()
        self.link.ask()
        self.log.reports += self.link.poll()
        now = self.link.port.now()
        if self.tracker is not None:
            self.tracker.poll(now)
        self._replies(now)
        self._judge(now, boot)
        if self._watch is not None:
            self._watch(self)

    def _pump(self) -> None:
        """Lines as long as the controller's receive buffer surely has room."""
        while self._sent < len(self.lines):
            size = len(self.lines[self._sent])
            if sum(self._out) + size > self._room:
                return
            self.link.port.write(self.lines[self._sent])
            self._out.append(size)
            self._sent += 1
            self.log.most = max(self.log.most, sum(self._out))

    def _replies(self, now: float) -> None:
        while self.link.replies and self._out:
            code = self.link.replies.popleft()
            line = self.lines[self.answered].decode().strip()
            self._out.popleft()
            self.log.answered.append(now)
            if code:
                raise InputError(f"controller: {line}: {grbl_words.error(code, self.link.family)}")

    def _judge(self, now: float, boot: int) -> None:
        """Raises InputError for what ends a run."""
        link = self.link
        if link.alarm:
            raise InputError(f"controller: {grbl_words.alarm(link.alarm, link.family)}")
        if link.restarts > boot:
            self.log.known = False
            raise InputError("controller: it was reset in the run")
        if now - link.heard_at > SILENT:
            raise InputError("controller: silent; check power and cable")
        state = self.log.reports[-1].report.state if self.log.reports else "Idle"
        if state not in STATES:
            raise InputError(f"controller: state {state} in the run, expected Run")
        if STATES[state]:
            raise InputError(f"controller: {STATES[state]}")

    def _stand(self) -> None:
        """Until it reports that it stands; the last place."""
        deadline = self.link.port.now() + HELD
        while self.link.port.now() < deadline:
            heard = self.link.fresh()
            self.log.reports.append(heard)
            if self.tracker is not None:
                self.tracker.poll(heard.heard)
            if heard.report.state == "Idle":
                self.log.place = self.link.locate()
                return
        raise InputError("controller: it did not come to rest at the end")

    def _stop(self) -> None:
        """Feed hold, wait until it stands, then drop what it holds by a reset; a second Ctrl-C
        resets in motion."""
        try:
            if not self.link.alarm and self._hold():
                self.link.reset()
            self._where()
        except KeyboardInterrupt:
            self.link.port.write(RESET)
            self.log.trouble, self.log.known = "interrupted twice: reset in motion", False
        except (LinkLostError, InputError, OSError) as error:
            self.log.known = False
            self.log.trouble += f"; no answer to the stop ({error})"

    def _hold(self) -> bool:
        """Whether it came to stand by a feed hold."""
        self.link.port.write(HOLD)
        deadline = self.link.port.now() + HELD
        while self.link.port.now() < deadline and not self.link.alarm:
            heard = self.link.fresh(0.1)
            self.log.reports.append(heard)
            state, sub = heard.report.state, heard.report.sub
            if state == "Idle" or (state == "Hold" and not sub) or (state == "Door" and sub != 2):
                return True
        return False

    def _where(self) -> None:
        """The place after a stop, where it means something."""
        if self.link.alarm:
            self.log.known &= not grbl_words.lost(self.link.alarm)
            return  # it says no more until it is reset: the last report may be from before
        self.log.place = self.link.locate()

    def _reconnect(self) -> None:
        """Wait for the port, to learn where the carriage stands; nothing is ever resumed."""
        port, boot = self.link.port, self.link.restarts
        deadline = port.now() + RECONNECT
        self.log.known = False
        while port.now() < deadline:
            if port.reopen():
                self.log.trouble += "; it is back"
                with suppress(LinkLostError, InputError, OSError):
                    port.write(HOLD)
                    held = self._hold()
                    self.log.known = held and self.link.restarts == boot
                    self.link.reset()
                    self._where()
                return
