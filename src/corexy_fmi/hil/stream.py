"""Segments to the board, ahead of time: numbered frames, credits, go-back-N."""

from __future__ import annotations

from dataclasses import dataclass

from corexy_fmi.hil.board import Board
from corexy_fmi.hil.protocol import SEGMENT, Cause, Message, Reply, Status, Type
from corexy_fmi.hil.segments import Segment

WINDOW = 220  # [bytes] on their way: the board has room for 255
OVERHEAD = 7  # [bytes] of a frame beside its body
SEGMENTS, CAREFUL = 5, 1  # in a frame; after a loss
TWICE = 2  # times that a frame is sent while frames get lost
CALM = 64  # frames without a loss until frames are long again
AGAIN, TIMEOUT = 4e-3, 20e-3  # [s] between two goings-back; without any progress
TURN = 1 << 16


@dataclass(frozen=True)
class _Frame:
    body: bytes
    segments: int
    ends: int  # segments up to and with this frame


class Stream:
    """Sends segments once each, in order, however many frames are lost.

    ``sent_again`` counts repeated frames.  Call `pump` often.
    """

    def __init__(self, board: Board, segments: tuple[Segment, ...], queue: int) -> None:
        self._board, self._segments = board, segments
        self._frames: list[_Frame] = []
        self._base = self._next = 0
        self._free = queue
        self._back_at = self._progress_at = board.port.now()
        self._calm = 0  # short frames until the link has shown that it is good
        self._lossy = False
        self.sent_again = 0
        board.listeners.append(self._hear)

    def close(self) -> None:
        """Hear nothing more."""
        self._board.listeners.remove(self._hear)

    @property
    def accepted(self) -> int:
        """Segments that the board has taken."""
        return self._frames[self._base - 1].ends if self._base else 0

    @property
    def done(self) -> bool:
        """All segments are at the board."""
        return self.accepted == len(self._segments)

    def pump(self) -> None:
        """Send what the board has room for."""
        now = self._board.port.now()
        if self._base < self._next and now - self._progress_at > TIMEOUT:
            self._go_back(now)
        while (frame := self._frame(self._next)) is not None:
            out = self._frames[self._base : self._next]
            waiting = sum(f.segments for f in out)
            times = TWICE if self._lossy else 1
            size = times * sum(len(f.body) + OVERHEAD for f in (*out, frame))
            if self._free - waiting < frame.segments or size > WINDOW:
                return
            if not out:
                self._progress_at = now
            for _ in range(times):
                self._board.send(Type.SEGMENTS, frame.body, self._next)
            self._next += 1

    def _frame(self, number: int) -> _Frame | None:
        """A frame by its number; what was sent once never changes."""
        if number < len(self._frames):
            return self._frames[number]
        begin = self._frames[-1].ends if self._frames else 0
        size = SEGMENTS if self._calm >= CALM else CAREFUL
        chosen = self._segments[begin : begin + size]
        if not chosen:
            return None
        self._calm += 1
        self._lossy &= self._calm < CALM
        body = b"".join(SEGMENT.pack(*segment) for segment in chosen)
        self._frames.append(_Frame(body, len(chosen), begin + len(chosen)))
        return self._frames[-1]

    def _hear(self, message: Message, now: float) -> None:
        if isinstance(message, Status):
            self._credit(message.next_frame, message.free, now)
        elif isinstance(message, Reply) and message.type == Type.SEGMENTS:
            self._credit(message.next_frame, message.free, now)
            lost = message.code in (Cause.REFUSED_ORDER, Cause.REFUSED_FULL)
            if lost and self._next > self._base and now - self._back_at > AGAIN:
                self._go_back(now)

    def _credit(self, following: int, free: int, now: float) -> None:
        ahead = (following - self._base) % TURN
        if ahead <= self._next - self._base:
            if ahead:
                self._progress_at = now
            self._base += ahead
            self._free = free

    def _go_back(self, now: float) -> None:
        self.sent_again += self._next - self._base
        self._next = self._base
        self._back_at = self._progress_at = now
        self._calm = 0
        self._lossy = True
