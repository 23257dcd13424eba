"""Runs where no C compiler is at hand: the Python reference does them, thousands of times slower.

Where the cache holds a kernel of the bundled catalogue, the sets in which a user's own effects are
off still run on that, at full speed; only the others go the slow way.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from corexy_fmi.effects import catalogue
from corexy_fmi.effects.api import Effect
from corexy_fmi.kernel.call import LANES, Array, Excitation, has_kernel, run_lanes
from corexy_fmi.kernel.layout import FREE_FORM_LOCATIONS, FREE_FORM_SIZE, Layout, bundled_layout
from corexy_fmi.kernel.reference import ReferenceStage
from corexy_fmi.kernel.reference_run import NO_REST, run_reference
from corexy_fmi.kernel.steps import STEP_RESOLUTION
from corexy_fmi.kernel.trace import argument_names
from corexy_fmi.parameters import NOMINAL

BROKE = (ArithmeticError, ValueError)  # what Python says where C goes on with infinities


def run_slowly(
    layout: Layout,
    excitation: Excitation,
    parameters: Array,
    *,
    inputs: Array | None,
    fidelity: str,
    dc: bool,
    begun: tuple[Array, Array],
    channels: tuple[str, ...],
    limit: float,
) -> Array:
    """`run_lanes` without a compiler: (sets, channels, rows); NaN where a run breaks down."""
    out = np.full((len(parameters), len(channels), len(excitation.time)), np.nan)
    fast = _without_own(layout, parameters)
    if fast.any():
        out[fast] = run_lanes(
            bundled_layout(),
            excitation,
            _bundled(layout, parameters[fast]),
            inputs=None if inputs is None else inputs[:, fast],
            fidelity=fidelity,
            dc=dc,
            rest=begun[0][fast],
            push=begun[1][fast],
            channels=channels,
            limit=limit,
        )
    slow = np.flatnonzero(~fast)
    if not limit and len(slow):
        limit = min(slow_step_limit(layout, parameters[n], fidelity, dc) for n in slow)
    for n in slow:
        try:
            with np.errstate(all="ignore"):
                found = run_reference(
                    layout, excitation.of_set(inputs, n), parameters[n], fidelity=fidelity, dc=dc,
                    rest=begun[0][n], push=begun[1][n], limit=limit, channels=channels,
                )  # fmt: skip
            out[n] = [found[c] for c in channels]
        except BROKE:
            continue
    return out


def _without_own(layout: Layout, parameters: Array) -> np.ndarray:
    """Sets (sets,) that the bundled kernel can run: it is cached, and no effect of a user is on."""
    bundled = bundled_layout()
    lanes = 1 if len(parameters) == 1 else LANES
    if layout is bundled or not all(has_kernel(bundled, n) for n in {1, lanes}):
        return np.zeros(len(parameters), dtype=bool)
    off = np.ones(len(parameters), dtype=bool)
    for instance in layout.instances:
        if instance.effect.name not in catalogue():
            for k, p in enumerate(instance.effect.parameters):
                off &= (parameters[:, instance.parameter + k] == p.neutral) | (not p.size)
    return off


def _bundled(layout: Layout, parameters: Array) -> Array:
    """Parameters (sets, n) in the order of the bundled catalogue."""
    bundled, nominal = bundled_layout(), len(NOMINAL)
    found = np.zeros((len(parameters), bundled.parameters))
    found[:, :nominal] = parameters[:, :nominal]
    for i in bundled.instances:
        first, count = layout.find(i.effect.name, i.location).parameter, len(i.effect.parameters)
        found[:, i.parameter : i.parameter + count] = parameters[:, first : first + count]
    laws = len(FREE_FORM_LOCATIONS) * FREE_FORM_SIZE
    found[:, bundled.free_form :] = parameters[:, layout.free_form : layout.free_form + laws]
    return found


def slow_step_limit(layout: Layout, vector: Array, fidelity: str, dc: bool) -> float:
    """Longest micro-step [s] of one parameter set (layout.parameters,), as the kernel's own."""
    stage = ReferenceStage(layout, vector, fidelity, dc)
    if not stage.stage.dynamic:
        return 1.0
    stage.begin(0.0, (0.0, 0.0), NO_REST)
    poles = stage.poles()
    pole = max(poles.viscous, poles.of_axes if stage.tied else poles.damped)
    square = max(poles.square, pole * pole, _effects_square(layout, vector, stage))
    return float(min(1.0, STEP_RESOLUTION / np.sqrt(square), poles.longest))


def _effects_square(layout: Layout, vector: Array, stage: ReferenceStage) -> float:
    """The fastest square [1/s^2] that the effects bring with them."""
    a, found = stage.a, [0.0]
    about = {"carriage": a["mass"][0], "bridge": a["mass"][1], "rotor_inertia": a["mass"][2]}
    about |= {"spacing": a["spacing"][0], "span_stiffness": (*a["stiffness0"], 0.0, 0.0)[1]}
    for i in layout.instances:
        values = [float(v) for v in vector[i.parameter : i.parameter + len(i.effect.parameters)]]
        if i.effect.pole is not None and _is_on(i.effect, values):
            names = [p.name for p in i.effect.parameters]
            known = {**about, **dict(zip(names, values, strict=True))}
            read = argument_names(i.effect.pole)
            square: Any = i.effect.pole(**{n: known[n] for n in read})
            found.append(float(square))
    return max(found)


def _is_on(effect: Effect, values: list[float]) -> bool:
    pairs = zip(effect.parameters, values, strict=True)
    return any(p.size and value != p.neutral for p, value in pairs)
