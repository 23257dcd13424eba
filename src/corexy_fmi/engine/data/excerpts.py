"""Long recordings are fitted in excerpts, and judged whole.

An hour at 1 kHz holds far more than a verdict needs, and its Jacobians far more than memory does.
Excerpts are chosen for the motion that they show: each adds the most places, speeds and directions
that those before it lack; once nothing is new, the farthest in time from all of them is next.  An
excerpt begins `LEAD` seconds early, at rest on its command; what that leaves dies out before its
samples count.  Its clock is the recording's, but memories begin anew with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from corexy_fmi.engine.data.samples import GAP, LONG, Run, Samples
from corexy_fmi.kernel.layout import Layout
from corexy_fmi.kernel.ports import HOST
from corexy_fmi.kernel.trace import argument_names
from corexy_fmi.recording import inputs

PIECES = 8  # excerpts of all recordings together
LEAD = 3 * GAP  # [s]
PLACES, SPEEDS = 8, 4  # cells of each input over its range; of each rate, on either side of rest


@dataclass(frozen=True)
class _Piece:
    """Rows [first, last) of a run whose samples count."""

    run: int
    first: int
    last: int


def needed(runs: Sequence[Run]) -> bool:
    """Whether these runs together are too long to be fitted whole."""
    return sum(len(run.excitation.time) for run in runs) > LONG


def excerpts(runs: Sequence[Run]) -> list[Run]:
    """The runs themselves, or where they are too long excerpts of about `LONG` rows in all."""
    if not needed(runs):
        return list(runs)
    pieces = _pieces(runs)
    chosen = _chosen(runs, pieces)
    return [_excerpt(runs[p.run], p, _name(runs[p.run], p)) for p in chosen]


def late_part(run: Run) -> Run:
    """A long run from shortly before its first sample on, under its own name."""
    rows = len(run.excitation.time)
    first = min((int(s.index[0]) for s in run.samples), default=0)
    if rows <= LONG or run.excitation.mode == "voltages":
        return run
    return _excerpt(run, _Piece(0, first, rows), run.name)


def restarted(layout: Layout) -> frozenset[str]:
    """Effects that count time from the beginning of a recording: excerpts do not show it."""
    return frozenset(
        i.effect.name
        for i in layout.instances
        for law in i.effect.laws
        if law.port in HOST or "elapsed" in argument_names(law.function)
    )


def _pieces(runs: Sequence[Run]) -> list[_Piece]:
    """Every run in pieces that hold samples; where voltages drive it only its beginning, as nobody
    knows the state further on.
    """
    size, found = LONG // PIECES, []
    for r, run in enumerate(runs):
        rows = len(run.excitation.time)
        if run.excitation.mode == "voltages":
            found.append(_Piece(r, 0, min(rows, LONG // len(runs))))
            continue
        edges = np.linspace(0, rows, max(rows // size, 1) + 1).astype(int)
        found += [_Piece(r, int(a), int(b)) for a, b in pairwise(edges)]
    return [p for p in found if _samples(runs[p.run], p.first, p.last, 0)]


def _chosen(runs: Sequence[Run], pieces: list[_Piece]) -> list[_Piece]:
    """The pieces that show the most, in the order of runs and time."""
    cells = _shown(runs, pieces)
    seen: set[int] = set()
    taken: list[int] = []
    while len(taken) < min(PIECES, len(pieces)):
        rest = [n for n in range(len(pieces)) if n not in taken]
        best = max(rest, key=lambda n: (len(cells[n] - seen), _apart(pieces, taken, n), -n))
        taken.append(best)
        seen |= cells[best]
    return [pieces[n] for n in sorted(taken)]


def _apart(pieces: list[_Piece], taken: list[int], n: int) -> int:
    """How far a piece lies from those that are taken, in pieces; other runs are far."""
    far = len(pieces)
    return min((abs(n - t) if pieces[n].run == pieces[t].run else far for t in taken), default=far)


def _shown(runs: Sequence[Run], pieces: list[_Piece]) -> list[set[int]]:
    """Cells of place and of speed of both inputs that each piece passes, on one grid for all."""
    place = [np.array([run.excitation.input1, run.excitation.input2]) for run in runs]
    rate = [np.gradient(p, run.excitation.time, axis=1) for p, run in zip(place, runs, strict=True)]
    low = np.min([p.min(axis=1) for p in place], axis=0)[:, None]
    reach = np.max([p.max(axis=1) for p in place], axis=0)[:, None] - low
    fastest = np.max([np.abs(v).max(axis=1) for v in rate], axis=0)[:, None]
    found = []
    for p in pieces:
        at, moving = place[p.run][:, p.first : p.last], rate[p.run][:, p.first : p.last]
        where = np.floor(PLACES * (at - low) / (1.001 * reach + 1e-12)).astype(int)
        speed = np.rint(SPEEDS * moving / (fastest + 1e-12)).astype(int) + SPEEDS
        codes = where[0] * PLACES + where[1], speed[0] * (2 * SPEEDS + 1) + speed[1]
        found.append({*map(int, np.unique(codes[0])), *(-1 - int(c) for c in np.unique(codes[1]))})
    return found


def _name(run: Run, piece: _Piece) -> str:
    time = run.excitation.time
    return f"{run.name} {time[piece.first]:.1f}-{time[piece.last - 1]:.1f} s"


def _samples(run: Run, first: int, last: int, begin: int) -> tuple[Samples, ...]:
    """The samples of rows [first, last), counted from row ``begin``."""
    found = []
    for s in run.samples:
        here = (s.index >= first) & (s.index < last)
        if here.sum() > 20:
            breaks = s.breaks[here]
            breaks[0] = True
            found.append(Samples(s.channel, s.index[here] - begin, s.value[here], breaks))
    return tuple(found)


def _excerpt(run: Run, piece: _Piece, name: str) -> Run:
    """Rows of a run with their lead-in, as a run of its own; at the recording's own start there is
    nothing to lead in.
    """
    e = run.excitation
    begin = int(np.searchsorted(e.time, e.time[piece.first] - LEAD)) if piece.first else 0
    rows = slice(begin, piece.last)
    drive = replace(e, time=e.time[rows], input1=e.input1[rows], input2=e.input2[rows])
    if begin:
        drive = replace(drive, first_angles=None, lead=0.0)
    channels = {n: v[rows] for n, v in {**run.recording.channels, **inputs(run.recording)}.items()}
    recording = replace(run.recording, name=name, time=e.time[rows], channels=channels)
    samples = _samples(run, piece.first, piece.last, begin)
    return Run(name, run.role, recording, drive, samples)
