"""One case: what was done, what may be said of it, and its three recordings as files."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.shop.motions import Motion, angles
from benchmarks.shop.simulator import simulate
from benchmarks.shop.stage import LIGHT_BENCH, YIN2018, Array, Faults, Numbers

NUMBERS = {"yin2018": YIN2018, "light_bench": LIGHT_BENCH}
TRAIN, HOLDOUT = ("train1.csv", "train2.csv"), ("holdout.csv",)
NOISE = 2e-5  # [m]
NOTHING, EXPLAINED, AMBIGUOUS = "nothing_missing", "explained", "ambiguous"
UNEXPLAINED = "unexplained"
Pair = tuple[str, str]  # effect, location
Sensor = Callable[[int, Array, Array, np.random.Generator], Array]  # which run, time, x and y


class Run(NamedTuple):
    """Time [s], logged motor angles [rad], where the stage was [m]."""

    time: Array
    logged: Array
    xy: Array


@dataclass(frozen=True)
class Truth:
    """What may be said: verdicts; sets of causes, one of which is named; places to point at."""

    text: str
    allowed: frozenset[str]
    causes: tuple[frozenset[Pair], ...] = ()
    places: frozenset[str] = frozenset()


def nothing() -> Truth:
    """The model holds, whatever its numbers are."""
    return Truth("nothing", frozenset({NOTHING}))


def named(places: str, *causes: Sequence[Pair], also: str = "") -> Truth:
    """One of these sets of catalogued effects; ``also``: other verdicts that are right."""
    text = " + ".join(f"{name} at {place}" for name, place in causes[0])
    allowed = frozenset({EXPLAINED, AMBIGUOUS, *also.split()})
    return Truth(text, allowed, tuple(map(frozenset, causes)), frozenset(places.split()))


def outside(places: str, also: str = "") -> Truth:
    """No effect of the catalogue: anything but `explained`."""
    allowed = frozenset({UNEXPLAINED, AMBIGUOUS, *also.split()})
    return Truth("outside the catalogue", allowed, (), frozenset(places.split()))


def exact(n: int, time: Array, xy: Array, random: np.random.Generator) -> Array:
    """A sensor, or a log, that changes nothing."""
    return xy


@dataclass(frozen=True)
class Case:
    """``runs`` are seen by a ``sensor``, get white noise, and pass a ``log``; of ``columns``, a
    sample every so many rows.
    """

    name: str
    machine: str
    done: str
    truth: Truth
    runs: Callable[[], list[Run]] = field(repr=False)
    sensor: Sensor = exact
    log: Sensor = exact
    noise: float = NOISE
    columns: str = "xy"
    every: int = 1


def driven(
    numbers: Numbers,
    motions: Sequence[Motion],
    faults: Faults | Callable[[int, Motion], Faults] | None = None,
    played: Callable[[int, Array, Array], Array] | None = None,
) -> list[Run]:
    """The stage under each motion; ``played`` turns the logged angles into what motors did."""
    runs = []
    for n, (time, xy) in enumerate(motions):
        logged = angles(xy)
        done = played(n, time, logged) if played else logged
        wrong = faults(n, (time, xy)) if callable(faults) else faults
        runs.append(Run(time, logged, simulate(time, done, numbers, wrong)[0][:, :2]))
    return runs


def recorded(case: Case) -> list[dict[str, Array]]:
    """Columns of each recording."""
    tables = []
    for n, run in enumerate(case.runs()):
        random = np.random.default_rng(100 + n)
        white = case.noise * random.standard_normal(run.xy.shape)
        seen = case.sensor(n, run.time, run.xy, random) + white
        seen = case.log(n, run.time, seen, random).copy()
        seen[np.arange(len(seen)) % case.every != 0] = np.nan
        told = {c: seen[:, "xy".index(c)] for c in case.columns}
        angle = {"phi1": run.logged[:, 0], "phi2": run.logged[:, 1]}
        tables.append({"time": run.time} | angle | told)
    return tables


def write(case: Case, folder: Path) -> None:
    """The recordings as CSV; a row without a sample has a blank cell."""
    for name, columns in zip(TRAIN + HOLDOUT, recorded(case), strict=True):
        rows = np.column_stack(list(columns.values())).tolist()
        with (folder / name).open("w", newline="", encoding="utf-8") as file:
            out = csv.writer(file)
            out.writerow(columns)
            out.writerows(["" if v != v else repr(v) for v in row] for row in rows)
