"""Model: a fit as a machine, with intervals, pulls, and bounds on what was not named."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.free_form import (
    LawShape,
    law_values,
    onset_key,
    onsets,
    viscous_key,
    viscous_share,
)
from corexy_fmi.engine.fitting.unknowns import Unknown
from corexy_fmi.engine.naming.screen import Lead
from corexy_fmi.kernel.call import Array
from corexy_fmi.machine import EffectUse, FreeForm, Machine
from corexy_fmi.parameters import NUMERICS

WHOLE = 0.98  # share of a parameter's range from which on an interval tells nothing of it
Z95 = 1.959963984540054
Ends = tuple[float, float]  # of an interval, on the internal scale


def covariance(fit: Fit) -> Array:
    """Covariance (size, size) of the internal vector, from the Jacobian at the fit; a share of two
    laws is no less sure than that its 95 % interval reaches from one to the other.
    """
    normal = fit.jacobian.T @ fit.jacobian
    for k, unknown in enumerate(fit.problem.unknowns):
        normal[k, k] += (Z95 / unknown.span) ** 2 if unknown.span else 0.0
    scale = np.sqrt(np.diag(normal)) + 1e-12
    correlation = normal / np.outer(scale, scale) + 1e-10 * np.eye(len(normal))
    return np.asarray(np.linalg.pinv(correlation, hermitian=True) / np.outer(scale, scale))


def _wrapped(unknown: Unknown, value: float) -> float:
    """A phase brought into (-pi, pi]."""
    turns = unknown.key.partition("@")[0].endswith(".phase")
    return math.remainder(value, 2 * math.pi) if turns else value


def ends(fit: Fit, spread: Array | None = None) -> dict[str, Ends]:
    """Of each unknown's 95 % interval, by key, as its ``spread`` (size, size) tells."""
    spread = covariance(fit) if spread is None else spread
    reach = Z95 * np.sqrt(np.maximum(np.diag(spread), 0.0))
    low, high = (fit.u - reach).tolist(), (fit.u + reach).tolist()
    return {x.key: (low[k], high[k]) for k, x in enumerate(fit.problem.unknowns)}


def interval(fit: Fit, k: int, reached: Ends) -> dict[str, object]:
    """Value, unit-free, with its 95 % interval inside the bounds."""
    unknown = fit.problem.unknowns[k]
    value = float(unknown.value(float(fit.u[k])))
    low, high = (float(unknown.value(end)) for end in reached)
    shift = _wrapped(unknown, value) - value
    return {"value": value + shift, "ci95": [low + shift, high + shift]}


def tuned_machine(fit: Fit, name: str, run: int = 0) -> Machine:
    """The machine of a fit: nominal parameters retuned, found effects and laws included.

    What belongs to one recording has the value of that ``run``.
    """
    problem = fit.problem
    machine = problem.machine
    parameters = dict(machine.parameters)
    uses: dict[tuple[str, str], dict[str, float]] = {}
    for k, unknown in enumerate(problem.unknowns):
        if unknown.run not in (None, run):
            continue
        value = _wrapped(unknown, float(unknown.value(fit.u[k])))
        if unknown.key.startswith("free_form"):
            continue
        if "." in unknown.key:
            effect, location, parameter = unknown.key.partition("@")[0].split(".")
            uses.setdefault((effect, location), {})[parameter] = value
        else:
            parameters[unknown.key] = value
    for i in problem.hypothesis.uses:
        starts = {p.name: p.neutral for p in i.effect.parameters if p.initial}
        uses.setdefault((i.effect.name, i.location), {}).update(starts)
    effects = tuple(EffectUse(n, loc, p) for (n, loc), p in uses.items())
    forms = tuple(
        FreeForm(
            law.location,
            law.argument,
            law.knots,
            tuple(law_values(fit, law)),
            law.acts,
            viscous_share(fit, law),
            onsets(fit, law)[run],
        )
        for law in problem.hypothesis.laws
    )
    return replace(
        machine,
        name=name,
        parameters=parameters,
        effects=machine.effects + effects,
        free_forms=machine.free_forms + forms,
    )


def retuned_table(fit: Fit, spread: Array) -> dict[str, dict[str, object]]:
    """The nominal parameters of a fit with unit, interval and pull (CONTRACT 4)."""
    table: dict[str, dict[str, object]] = {}
    units = {p.name: p.unit for p in fit.problem.machine.kind.parameters}
    reached = ends(fit, spread)
    for k, unknown in enumerate(fit.problem.unknowns):
        if "." in unknown.key or unknown.key in NUMERICS:
            continue
        pull = float(fit.u[k]) / unknown.prior_std
        driven = math.sqrt(max(float(spread[k, k]), 0.0)) > 0.7 * unknown.prior_std
        entry = interval(fit, k, reached[unknown.key])
        table[unknown.key] = {
            "value": entry["value"],
            "unit": units[unknown.key],
            "ci95": entry["ci95"],
            "pull": pull,
            "prior_driven": driven,
        }
    return table


def effect_table(
    fit: Fit, name: str, location: str, spread: Array, further: Sequence[Mapping[str, Ends]] = ()
) -> dict[str, dict[str, object]]:
    """The parameters of one named effect with unit, interval, and whether data narrow its range.

    Intervals reach as far as any of ``further`` (`walked.py`).
    """
    instance = next(
        i for i in fit.problem.hypothesis.uses if (i.effect.name, i.location) == (name, location)
    )
    units = {p.name: p.unit_at(location) for p in instance.effect.parameters}
    known, table = [ends(fit, spread), *further], {}
    for k, unknown in enumerate(fit.problem.unknowns):
        parameter = unknown.key.removeprefix(f"{name}.{location}.")
        if parameter != unknown.key:
            low, high = zip(*(e[unknown.key] for e in known if unknown.key in e), strict=True)
            reached = min(low), max(high)
            entry, unit = interval(fit, k, reached), units[parameter.partition("@")[0]]
            table[parameter] = {
                "value": entry["value"],
                "unit": unit,
                "ci95": entry["ci95"],
                "determined": _determined(reached, _range(fit, unknown, unit)),
            }
    return table


def law_table(fit: Fit, law: LawShape, spread: Array) -> dict[str, dict[str, object]]:
    """What a law has beside its values: when its time begins in a recording [s], how its friction
    grows with speed [s/m]; each with its interval.
    """
    reached, known = ends(fit, spread), fit.problem.keys
    asked = {f"onset@{run.name}": (onset_key(law, run.name), "s") for run in fit.problem.runs}
    asked["viscous"] = viscous_key(law), "s/m"
    return {
        name: interval(fit, known.index(key), reached[key]) | {"unit": unit}
        for name, (key, unit) in asked.items()
        if key in known
    }


def _range(fit: Fit, unknown: Unknown, unit: str) -> Ends:
    """What the catalogue allows (internal); of a time in one recording, its length either way."""
    low, high = unknown.range()
    if unknown.run is None or unit != "s":
        return low, high
    length = float(np.ptp(fit.problem.runs[unknown.run].excitation.time))
    return max(low, unknown.internal(-length)), min(high, unknown.internal(length))


def _determined(reached: Ends, allowed: Ends) -> bool:
    """Whether an interval leaves out any of the range that is allowed."""
    low, high = allowed
    return min(reached[1], high) - max(reached[0], low) < WHOLE * (high - low)


def upper_bound(lead: Lead) -> dict[str, object]:
    """The ``not_excluded`` entry of a lead."""
    instance = lead.hypothesis.uses[-1]
    size = instance.effect.size
    value, parameter, unit = lead.bound, size.name, size.unit_at(instance.location)
    if size.scaling < 0:  # the rigid limit is at infinity: bound its inverse
        parameter, unit = f"1/{parameter}", f"1/({unit})"
    else:
        value = min(size.neutral + value, size.upper)
    return {
        "name": instance.effect.name,
        "location": instance.location,
        "parameter": parameter,
        "upper95": float(value),
        "unit": unit,
    }
