"""One motion on a board: armed, filled ahead, started at a tick, watched to its end."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field

from corexy_fmi.errors import InputError
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.port import LinkLostError
from corexy_fmi.hil.protocol import ADVICE, WORD, Cause, Flag, Message, State, Status, Type
from corexy_fmi.hil.segments import Plan
from corexy_fmi.hil.stream import Stream
from corexy_fmi.hil.tracker import Tracker

AHEAD = 0.1  # [s] at least: less than this in the board's queue is too slow a host
LEAD, LATE = 0.2, 10  # [s] from RUN to the first tick of the motion; tries if it came too late
RECONNECT = 5.0  # [s] to wait for a port that went away
SILENT = 1.0  # [s] without a report: the board is gone, or busy beyond hope
STOPPED = 3.0  # [s] within which a ramp must have ended


@dataclass
class Log:
    """What happened: reports as (tick, counts), the motion's first tick, the cause of a stop.

    ``buffered`` is the least time [s] that lay in the board's queue before the last segment was
    sent; ``pause`` the longest time [s] between two looks at the port.
    """

    plan: Plan
    reports: list[tuple[int, tuple[int, int]]] = field(default_factory=list)
    start: int = 0
    end: int | None = None
    cause: Cause = Cause.NOTHING
    trouble: str = ""
    counts: tuple[int, int] = (0, 0)
    known: bool = True
    buffered: float = float("inf")
    pause: float = 0.0
    sent_again: int = 0
    frames_bad: int = 0

    @property
    def complete(self) -> bool:
        """The motion came to its end, and a stepper board counted what was commanded."""
        return not self.trouble and (not self.plan.scale.steps or self.counts == self.plan.counts)

    def played(self) -> float:
        """Time [s] of the motion up to which the board followed the plan."""
        last = self.reports[-1][0] if self.reports else self.start
        end = last if self.end is None else self.end
        return max(0.0, (end - self.start) * self.plan.scale.tick)


Watcher = Callable[["Drive"], None]


class Drive:
    """Drives a board along a plan.

    ``watch`` is called between two looks at the port, about every millisecond; what it raises
    stops the motion with a ramp.  KeyboardInterrupt does the same.
    """

    def __init__(
        self, board: Board, plan: Plan, tracker: Tracker | None = None, watch: Watcher | None = None
    ) -> None:
        self.board, self.plan, self.tracker = board, plan, tracker
        self.log = Log(plan)
        self._watch = watch
        self._started = False
        self._heard = 0.0
        info = board.info
        if info is None:
            raise InputError("board: not connected")
        self._stream = Stream(board, plan.segments, info.queue)
        self._looked = board.port.now()
        self._boot = board.restarts

    def run(self) -> Log:
        """To the end, or to a stop; the log says which.  Raises nothing that the log can say."""
        log, board = self.log, self.board
        try:
            board.command(Type.ARM)
            self._fill()
            self._start()
            self._heard = board.port.now()
            board.listeners.append(self._hear)
            while self._moving():
                self._look()
        except LinkLostError as error:
            log.trouble = f"link lost ({error}): the board stops by itself; plug it in again"
            self._reconnect()
        except KeyboardInterrupt:
            log.trouble = "interrupted"
            self._ramp_down()
        except (InputError, OSError) as error:
            log.trouble = str(error)
            self._ramp_down()
        finally:
            self._finish()
        return log

    @property
    def time(self) -> float:
        """Time [s] of the motion at the last report; negative, -inf at first, before it starts."""
        status = self.board.status
        if not self._started or status is None:
            return -math.inf
        tick = status.tick
        return (self.board.clock.unwrapped(tick) - self.log.start) * self.plan.scale.tick

    def _look(self, wait: float = 1e-3) -> None:
        """Once around: frames in, segments and beats out, the tracker read."""
        self._stream.pump()
        self.board.keep_alive()
        self.board.poll(wait)
        if self.tracker is not None:
            self.tracker.poll(self.board.port.now())
        self.log.pause = max(self.log.pause, self._away())
        if self._watch is not None:
            self._watch(self)
            self._away()

    def _away(self) -> float:
        """Time [s] since it was last asked; a host that was away cannot call the board silent."""
        now = self.board.port.now()
        away, self._looked = now - self._looked, now
        if away > SILENT / 2:
            self._heard = now
        return away

    def _fill(self) -> None:
        """Segments ahead of the start: all of them, or until the queue takes no more."""
        deadline = self.board.port.now() + 2.0
        while not self._stream.done and self.board.port.now() < deadline:
            self._look()
            status = self.board.status
            if status and status.state is State.FAULT:
                raise InputError(ADVICE.get(status.fault, status.fault.name))
            if status and self._stream.accepted and status.free < 5:
                return

    def _start(self) -> None:
        """RUN at a tick ahead; a RUN that was lost on the way until then is refused and renewed."""
        lead = round(LEAD / self.plan.scale.tick)
        for _ in range(LATE):
            tick = (self.board.fresh_status().tick + lead) % (1 << 32)
            self.log.start = int(self.board.clock.unwrapped(tick))
            if self.board.request(Type.RUN, WORD.pack(tick)) is Cause.NOTHING:
                self._started = True
                return
            status = self.board.fresh_status()
            if status.state is State.FAULT:
                raise InputError(ADVICE.get(status.fault, status.fault.name))
        raise InputError("board: it did not start; the link is too bad, see `corexy hil check`")

    def _moving(self) -> bool:
        """Whether there is more to come; a stop by the board itself is written down."""
        status, log = self.board.status, self.log
        if self.board.restarts > self._boot:
            log.trouble, log.known = "board reset in the run; centre by hand, then --centred", False
            log.cause = Cause.REFUSED_STATE
            return False
        if self.board.port.now() - self._heard > SILENT:
            raise InputError("board: no reports; check power and cable, then `corexy hil check`")
        if status is None:
            return True
        if status.state is State.FAULT:
            log.cause = status.fault
            log.trouble = ADVICE.get(status.fault, status.fault.name)
            return False
        began = self.time > 0
        self._note_queue(status)
        return not (began and status.state is State.ARMED and self._stream.done)

    def _note_queue(self, status: Status) -> None:
        """How far ahead the board's queue reaches, while there is more to send."""
        if status.state is State.RUNNING and not self._stream.done:
            ahead = self.plan.ticks[self._stream.accepted] * self.plan.scale.tick - self.time
            self.log.buffered = min(self.log.buffered, ahead)

    def _hear(self, message: Message, now: float) -> None:
        if isinstance(message, Status):
            self._heard = now
            tick = int(self.board.clock.unwrapped(message.tick))
            self.log.reports.append((tick, message.counts))
            if message.state in (State.STOPPING, State.FAULT) and self.log.end is None:
                self.log.end = tick

    def _ramp_down(self) -> None:
        """STOP, and wait until it stands; a second interrupt is an emergency stop."""
        try:
            self.board.request(Type.STOP)
            deadline = self.board.port.now() + STOPPED
            while self.board.port.now() < deadline:
                self.board.poll()
                status = self.board.status
                if status and status.state not in (State.RUNNING, State.STOPPING):
                    self.log.cause = status.fault
                    return
        except KeyboardInterrupt:
            self.board.send(Type.ESTOP)
            self.log.trouble = "interrupted twice: emergency stop, drivers off"
        except (LinkLostError, InputError) as error:
            self.log.trouble += f"; no answer to the stop ({error})"

    def _reconnect(self) -> None:
        """Wait for the port, to learn where the carriage stands; nothing is ever resumed."""
        port = self.board.port
        deadline = port.now() + RECONNECT
        while port.now() < deadline:
            if port.reopen():
                with suppress(LinkLostError, InputError):
                    self.board.connect()
                    self.log.cause = self.board.fresh_status().fault
                    self.log.trouble += "; it is back"
                    return

    def _finish(self) -> None:
        """The last counts, and what went wrong on the way."""
        log, board = self.log, self.board
        self._stream.close()
        if self._hear in board.listeners:
            board.listeners.remove(self._hear)
        log.sent_again = self._stream.sent_again
        with suppress(LinkLostError, InputError):
            status = board.fresh_status()
            log.counts, log.frames_bad = status.counts, status.frames_bad
            log.known = bool(status.flags & Flag.POSITION_KNOWN)
            if not log.trouble and not log.complete:
                log.trouble = f"board counted {log.counts}, commanded {self.plan.counts}"
            if status.state is State.ARMED:
                board.request(Type.CLEAR)
            return
        log.known = False
