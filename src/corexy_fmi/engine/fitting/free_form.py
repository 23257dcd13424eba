"""A free-form law of a coordinate's force: its shape, its unknowns, and what a fit makes of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from corexy_fmi.engine.fitting.unknowns import Hypothesis, Unknown
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import (
    FIRST_VALUE,
    FREE_FORM_LOCATIONS,
    FREE_FORM_SIZE,
    LAW_KINDS,
    ONSET,
    VISCOUS,
    Layout,
    free_form_vector,
)

if TYPE_CHECKING:
    from corexy_fmi.engine.fitting.fit import Fit

PARITIES = {"odd": -1.0, "even": 1.0}  # the value at -v over that at v
SPEEDS = ("vx", "vy")
WIDE, FINITE = 30.0, 1e4  # prior and bound of a value, in its scale


@dataclass(frozen=True)
class LawShape:
    """A free-form law to be fitted: where it acts, on what it depends, and its knots.

    It ``acts`` as a force, or as a Coulomb friction beside that of an axis.  Where it has a
    ``parity``, its knots lie alike on both sides of zero.  ``stiffness`` is how strongly its prior
    holds it straight (`bending`).  One over time may count from an onset of its own in each
    recording but ``since``, and have a share that grows with speed where it is a friction.
    """

    location: str
    argument: str
    knots: tuple[float, ...]
    scale: float  # [N] or [N m]: the size that its values are expected to have
    parity: str = ""
    acts: str = "force"
    stiffness: float = 0.0
    since: str = ""  # the recording whose time is the law's; none: that of each
    fastest: float = 1.0  # [m/s]: a speed at which a friction may be twice as large

    @property
    def unit(self) -> str:
        """Of its values."""
        return "N m" if self.location.startswith("motor") else "N"

    @property
    def own(self) -> list[int]:
        """Knots whose values are unknowns of their own."""
        count = len(self.knots)
        middle = [count // 2] if count % 2 and self.parity == "even" else []
        return [*middle, *range((count + 1) // 2, count)] if self.parity else [*range(count)]


def law_unknowns(
    layout: Layout, law: LawShape, runs: Sequence[str] = (), length: float = 1.0
) -> list[Unknown]:
    """The values of a free-form law at its knots, with a wide prior that keeps them finite; where
    it has its own times in each of ``runs``, of ``length`` [s] at most, those, too.
    """
    return [*_values(layout, law), *(_times(layout, law, runs, length) if law.since else [])]


def onset_key(law: LawShape, run: str) -> str:
    """Of the unknown that tells when a law's time begins in a run."""
    return f"free_form.{law.location}.onset@{run}"


def viscous_key(law: LawShape) -> str:
    """Of the unknown that tells how a law's friction grows with speed."""
    return f"free_form.{law.location}.viscous"


def _times(layout: Layout, law: LawShape, runs: Sequence[str], length: float) -> list[Unknown]:
    """When a law's time begins in each run but the one whose own it is; of a friction the share by
    which it grows with speed [s/m].
    """
    viscous, onset = (law_offset(layout, law) + k for k in (VISCOUS, ONSET))
    found = [
        Unknown(onset_key(law, name), onset, 0.0, length / 4, False, (-length, length), 4.0, run=r)
        for r, name in enumerate(runs)
        if name != law.since
    ]
    if law.acts != "friction":
        return found
    scale = 1 / max(law.fastest, 1e-6)
    reach = (0.0, WIDE * scale)
    return [*found, Unknown(viscous_key(law), viscous, 0.0, scale, False, reach, WIDE)]


def _values(layout: Layout, law: LawShape) -> list[Unknown]:
    first, last = _values_at(layout, law), len(law.knots) - 1
    limit = (-FINITE * law.scale, FINITE * law.scale)
    found = []
    for i in law.own:
        key = f"free_form.{law.location}.values[{i}]"
        one = Unknown(key, first + i, 0.0, law.scale, False, limit, WIDE, force=True)
        mirrored = law.parity and last - i != i
        beside = (first + last - i, PARITIES[law.parity]) if mirrored else None
        found.append(replace(one, mirror=beside))
    return found


def bending(law: LawShape) -> Array:
    """What a law's values u (own,) bend, (rows, own): the integral of its squared second derivative
    over the argument, whose range is one, is the square of these.  A jump of friction where a speed
    turns is not bending: each way is a piece of its own.
    """
    at = np.array(law.knots) / (law.knots[-1] - law.knots[0])
    gaps, middle = np.diff(at), np.arange(len(at) - 2)
    whole = np.zeros((len(at) - 2, len(at)))
    whole[middle, middle] = 1 / gaps[:-1]
    whole[middle, middle + 1] = -1 / gaps[:-1] - 1 / gaps[1:]
    whole[middle, middle + 2] = 1 / gaps[1:]
    whole *= np.sqrt(2 / (gaps[:-1] + gaps[1:]))[:, None]
    if law.argument in SPEEDS:
        whole = whole[at[:-2] * at[2:] > 0]
    if not law.parity:
        return whole
    folded = whole + PARITIES[law.parity] * whole[:, ::-1]
    folded[:, len(at) // 2] *= 0.5 if len(at) % 2 else 1.0  # the middle is its own mirror
    return np.asarray(folded[:, law.own])


def law_places(unknowns: Sequence[Unknown], law: LawShape | None = None) -> list[int]:
    """Where the values of a law, of all where none is given, stand among the unknowns."""
    head = f"free_form.{law.location}." if law else "free_form."
    keys = [x.key for x in unknowns]
    return [k for k, key in enumerate(keys) if key.startswith(head) and ".values[" in key]


def law_offset(layout: Layout, law: LawShape) -> int:
    """Where a law begins in the kernel's vector."""
    return layout.free_form + FREE_FORM_LOCATIONS.index(law.location) * FREE_FORM_SIZE


def _values_at(layout: Layout, law: LawShape) -> int:
    return law_offset(layout, law) + FIRST_VALUE


def write_law(layout: Layout, vector: Array, law: LawShape) -> None:
    """Write a law's argument and knots into a parameter vector, its values at zero."""
    first = law_offset(layout, law)
    kind, none = LAW_KINDS.index((law.acts, law.argument)), [0.0] * len(law.knots)
    vector[first : first + FREE_FORM_SIZE] = free_form_vector(kind, law.knots, none)


def law_values(fit: Fit, law: LawShape | None = None) -> Array:
    """Values (knots,) [N or N m] of a fit's law, its first where none is given."""
    law = law or fit.problem.hypothesis.law
    assert law is not None
    first = _values_at(fit.problem.layout, law)
    return np.asarray(fit.problem.vectors(fit.u[None], 0)[0, first : first + len(law.knots)])


def onsets(fit: Fit, law: LawShape) -> list[float]:
    """When a law's time begins in each recording [s]."""
    return [_told(fit, onset_key(law, run.name)) for run in fit.problem.runs]


def viscous_share(fit: Fit, law: LawShape) -> float:
    """By how much of itself a law's friction grows with speed [s/m]."""
    return _told(fit, viscous_key(law))


def _told(fit: Fit, key: str) -> float:
    """An unknown's value; 0 where there is none."""
    if key not in fit.problem.keys:
        return 0.0
    k = fit.problem.keys.index(key)
    return float(fit.problem.unknowns[k].value(fit.u[k]))


def law_errors(fit: Fit, covariance: Array, law: LawShape | None = None) -> Array:
    """Standard deviations (knots,) of those, from the covariance (size, size) of u."""
    law = law or fit.problem.hypothesis.law
    assert law is not None
    own = law_places(fit.problem.unknowns, law)
    found = np.zeros(len(law.knots))
    found[law.own] = law.scale * np.sqrt(np.maximum(np.diag(covariance)[own], 0))
    return np.maximum(found, found[::-1]) if law.parity else found


def halved(fit: Fit, parity: str) -> tuple[Hypothesis, Array]:
    """The hypothesis with one half of a fit's law alone, and u (size,) to begin from."""
    law = fit.problem.hypothesis.law
    assert law is not None
    half = replace(law, parity=parity)
    values = law_values(fit)
    kept = (values + PARITIES[parity] * values[::-1]) / 2
    at = law_places(fit.problem.unknowns)
    u = np.concatenate([fit.u[: at[0]], kept[half.own] / law.scale, fit.u[at[-1] + 1 :]])
    return Hypothesis(law=half), u
