"""Commanded angles as segments of constant rate, in the integers that the firmware plays.

A position is P, an integer of which ``scale.one`` is one count; the count is floor(P / one).  What
`plan` returns is exact: the board's counts follow from it to the last step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.hil.limits import Limits, Scale

Array = NDArray[np.float64]
LONGEST = 10e-3  # [s] of a segment
TOLERANCE = 0.25  # [counts] of the path between rows
ZERO_TICKS, FEWEST_TICKS = 2, 5


class Segment(NamedTuple):
    """Ticks at a constant rate of each motor; no ticks: the motion ends."""

    ticks: int
    rate1: int
    rate2: int


END = Segment(0, 0, 0)


@dataclass(frozen=True)
class Plan:
    """Segments with the position where each begins and the last ends.

    ``ticks`` (n + 1,) from the start; ``positions`` (n + 1, 2), integers.
    """

    segments: tuple[Segment, ...]
    ticks: tuple[int, ...]
    positions: tuple[tuple[int, int], ...]
    scale: Scale

    @cached_property
    def time(self) -> Array:
        """Where segments meet, (n + 1,) in s."""
        return np.array(self.ticks) * self.scale.tick

    @cached_property
    def angles(self) -> Array:
        """Motor angles there, (n + 1, 2) in rad."""
        half, one = self.scale.one // 2, self.scale.one
        return np.array(
            [[self.scale.angle((p - half) / one) for p in row] for row in self.positions]
        )

    @property
    def counts(self) -> tuple[int, int]:
        """Counts at the end."""
        one = self.scale.one
        return self.positions[-1][0] // one, self.positions[-1][1] // one


def plan(time: Array, angles: Array, scale: Scale, start: tuple[int, int]) -> Plan:
    """Follow angles (n, 2) [rad], linear between times (n,) [s], from the counts of the board.

    Rows closer to the straight line than a quarter count are passed over; a stepper that reverses
    stands still for two ticks.  Raises InputError where rows are too near for the board's clock.
    """
    ticks = np.rint((time - time[0]) / scale.tick).astype(np.int64)
    goals = angles * scale.counts / (2 * np.pi)
    half, one = scale.one // 2, scale.one
    position = [count * one + half for count in start]
    segments: list[Segment] = []
    rates = (0, 0)
    for first, last in _spans(ticks, goals, scale):
        goal = [round(float(g) * one) + half for g in goals[last]]
        span = int(ticks[last] - ticks[first])
        for segment in _reach(position, goal, span, rates if scale.steps else (0, 0)):
            segments.append(segment)
            rates = segment[1:]
            for m in (0, 1):
                position[m] += segment.ticks * rates[m]
    if any(rates):
        segments.append(Segment(ZERO_TICKS, 0, 0))
    return _tracked([*segments, END], start, scale)


def _tracked(segments: list[Segment], start: tuple[int, int], scale: Scale) -> Plan:
    half, one = scale.one // 2, scale.one
    ticks, positions = [0], [(start[0] * one + half, start[1] * one + half)]
    for n, a, b in segments:
        ticks.append(ticks[-1] + n)
        positions.append((positions[-1][0] + n * a, positions[-1][1] + n * b))
    return Plan(tuple(segments), tuple(ticks), tuple(positions), scale)


def _spans(ticks: NDArray[np.int64], goals: Array, scale: Scale) -> list[tuple[int, int]]:
    """Pairs of rows between which the path is straight."""
    spans, first = [], 0
    longest, fewest = round(LONGEST / scale.tick), FEWEST_TICKS if scale.steps else 1
    while first < len(ticks) - 1:
        last = first + 1
        while last < len(ticks) - 1 and ticks[last] - ticks[first] < fewest:
            last += 1
        while last + 1 < len(ticks) and ticks[last + 1] - ticks[first] <= longest:
            inner = slice(first + 1, last + 1)
            share = (ticks[inner] - ticks[first]) / (ticks[last + 1] - ticks[first])
            chord = goals[first] + share[:, None] * (goals[last + 1] - goals[first])
            if np.abs(chord - goals[inner]).max() > TOLERANCE:
                break
            last += 1
        if ticks[last] - ticks[first] >= fewest:
            spans.append((first, last))
        elif spans:
            spans[-1] = (spans[-1][0], last)
        else:
            raise InputError("motion: shorter than the board's clock can play, expected more rows")
        first = last
    return spans


def _reach(
    position: Sequence[int], goal: Sequence[int], ticks: int, rates: Sequence[int]
) -> list[Segment]:
    """Segments from a position to a goal; the remainder of the division is left for the next."""
    wanted = [round((g - p) / ticks) for g, p in zip(goal, position, strict=True)]
    turns = [w * r < 0 for w, r in zip(wanted, rates, strict=True)]
    if not any(turns):
        return _split(ticks, wanted)
    pause = [0 if turn else rate for turn, rate in zip(turns, rates, strict=True)]
    left = ticks - ZERO_TICKS
    ways = [g - p - ZERO_TICKS * r for g, p, r in zip(goal, position, pause, strict=True)]
    after = [round(way / left) for way in ways]
    # a motor that kept its rate through the pause must not turn by the correction
    after = [0 if a * r < 0 else a for a, r in zip(after, pause, strict=True)]
    return [Segment(ZERO_TICKS, *pause), *_split(left, after)]


def _split(ticks: int, rates: list[int]) -> list[Segment]:
    """A stretch, in pieces where 16 bits cannot hold it."""
    if ticks < 65536:
        return [Segment(ticks, *rates)]
    pieces = [30000] * (ticks // 30000)
    rest = ticks - sum(pieces)
    return [Segment(n, *rates) for n in ([*pieces, rest] if rest else pieces)]


def check(plan: Plan, limits: Limits) -> None:
    """The firmware's own checks, before anything moves; raises InputError with time and remedy."""
    before = END
    for segment, tick, after in zip(plan.segments, plan.ticks, plan.positions[1:], strict=False):
        when = f"motion at {tick * plan.scale.tick:.3f} s"
        metres = 1 / (plan.scale.one * plan.scale.tick * plan.scale.per_metre)
        shorter = min(before.ticks, segment.ticks)
        for now, was in zip(segment[1:], before[1:], strict=True):
            if abs(now) > limits.rate:
                why = "--max-speed" if limits.rate < plan.scale.fastest else _most(plan.scale)
                raise InputError(f"{when}: a belt runs {abs(now) * metres:.4g} m/s, expected at "
                                 f"most {limits.rate * metres:.4g} ({why})")  # fmt: skip
            if abs(now - was) > limits.jump + limits.acceleration * shorter:
                raise InputError(f"{when}: a belt's speed jumps by {abs(now - was) * metres:.4g} "
                                 f"m/s, expected at most {limits.jump * metres:.4g}: give --accel, "
                                 "or --max-jump if the motors can")  # fmt: skip
        a, b = (p // plan.scale.one for p in after)
        if abs(a + b) > limits.x or abs(a - b) > limits.y:
            raise InputError(f"{when}: leaves the stage of the machine file")
        before = segment


def _most(scale: Scale) -> str:
    """What bounds the rate where it is not the user."""
    rate = scale.fastest / scale.one / scale.tick
    return f"the firmware's {rate:.0f} counts/s"
