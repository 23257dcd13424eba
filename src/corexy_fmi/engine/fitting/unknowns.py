"""What a fit may move: nominal parameters with priors, an effect's own, and a free-form law's."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from corexy_fmi.effects.api import Effect
from corexy_fmi.effects.api import Parameter as EffectParameter
from corexy_fmi.kernel.call import Array
from corexy_fmi.kernel.layout import (
    Instance,
)
from corexy_fmi.machine import Machine
from corexy_fmi.parameters import NUMERICS, PLACES

if TYPE_CHECKING:
    from corexy_fmi.engine.fitting.free_form import LawShape

STIFFNESS = (
    "belt_axial_stiffness"  # lags are sums of friction over stiffness: it alone is logarithmic
)
SMOOTHING, AT_PULLEYS = NUMERICS  # nuisances, always free (ENGINE 3.2, row 1)
SMOOTH_SPEED, OTHER = 2e-4, 1.5  # [m/s] scale of one; log of the other's
REACH = 6.0  # a nominal parameter stays within this factor of the machine file
WITHIN = 0.01  # share by which what is held may be off: a radius is not known any better
WAVES = 2.0  # that the longest run covers of any: one alone is a slow drift
ANY_EXTENT = {"1": math.inf, "Hz": math.inf}  # turns of a motor, seconds
COLLINEAR = {"pulley_mass": ("bridge_mass", 4)}  # held: four of it act as that does, in M (eq. 4)


@dataclass(frozen=True)
class Unknown:
    """One number of the kernel's vector that a fit moves, on an internal scale u.

    value = centre exp(u) where ``log``, else centre + scale u; the prior on u is normal around
    ``prior_mean`` with ``prior_std`` (infinite: none).  ``bounds`` are of the value.
    """

    key: str
    index: int
    centre: float
    scale: float
    log: bool
    bounds: tuple[float, float]
    prior_std: float = math.inf
    wave: bool = False  # a count or frequency of waves: valleys of the fit are narrow
    run: int | None = None  # the one run that it belongs to; None: all
    force: bool = False  # a mass, force or stiffness: its unit holds newtons or kilograms
    held: float = 0.0  # what acts as it does, is not fitted, and grows with the unit of force, too
    mirror: tuple[int, float] | None = None  # another index, and what its value is of this one's
    allowed: tuple[float, float] | None = None  # the catalogue's bounds, where a fit's are narrower
    span: float = 0.0  # between the laws that it is a share of, on the internal scale

    def value(self, u: Array | float) -> Array:
        """Physical value at u."""
        raw = (
            self.centre * np.exp(np.clip(u, -60, 60))
            if self.log
            else self.centre + self.scale * np.asarray(u)
        )
        return np.clip(raw, *self.bounds)

    def internal(self, value: float) -> float:
        """u at a physical value."""
        inside = min(max(value, self.bounds[0]), self.bounds[1])
        return math.log(inside / self.centre) if self.log else (inside - self.centre) / self.scale

    def near(self, number: float) -> Unknown:
        """The same, held near a count, or where it is a share at a number."""
        away, (low, high) = 0.0 if self.span else WITHIN * abs(number), self.bounds
        near = (max(number - away, low), min(number + away, high))
        return replace(self, bounds=near, allowed=self.bounds)

    def range(self) -> tuple[float, float]:
        """Of u, what the catalogue allows."""
        return replace(self, bounds=self.allowed or self.bounds).limits()

    def limits(self) -> tuple[float, float]:
        """Bounds of u."""
        low, high = self.bounds
        if not self.log:
            return (low - self.centre) / self.scale, (high - self.centre) / self.scale
        return (math.log(low / self.centre) if low > 0 else -40.0), math.log(high / self.centre)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """What is assumed to be missing: a set of (effect, location), a free-form law, with that of the
    other axis ``beside`` it or not, or nothing.
    """

    uses: tuple[Instance, ...] = ()
    law: LawShape | None = None
    beside: LawShape | None = None
    shaped: bool = False  # parameters of an effect's shape are fitted too
    held: tuple[tuple[str, float], ...] = ()  # unknowns near a number (`whole.py`, `forms.py`)

    @property
    def key(self) -> tuple[tuple[str, str], ...]:
        """Names and locations, sorted."""
        found = [(i.effect.name, i.location) for i in self.uses]
        found += [("free_form", law.location) for law in self.laws]
        return tuple(sorted(found))

    @property
    def laws(self) -> tuple[LawShape, ...]:
        """The free-form laws."""
        return tuple(law for law in (self.law, self.beside) if law is not None)

    @property
    def places(self) -> list[str]:
        """Coordinates (CONTRACT 4) where it acts."""
        found = [i.effect.coordinate or i.location for i in self.uses]
        both = ["xy"] if self.beside else []
        return [*found, *both, *(law.location for law in self.laws)]

    @property
    def label(self) -> str:
        """For a person to read."""
        law = f" over {self.law.argument}" if self.law else ""
        return " + ".join(f"{n} at {loc}" for n, loc in self.key) + law or "nothing"


def _weighs(unit: str) -> bool:
    """Whether what has that unit grows with the unit of force."""
    return unit.startswith(("N", "kg"))


def _held(machine: Machine, name: str) -> float:
    """What stands beside a parameter in the same sum, held."""
    beside = [(k, n) for k, (to, n) in COLLINEAR.items() if to == name]
    return sum(n * machine.parameters.get(k, 0.0) for k, n in beside)


def nominal_unknowns(machine: Machine, frees_rotor: bool) -> list[Unknown]:
    """The nominal parameters that these data can move and that the machine file leaves free."""
    idle = {*COLLINEAR, *NUMERICS}
    if machine.drive == "stepper":
        idle |= {"motor_torque_gain", "motor_damping_gain"}
        if not frees_rotor:
            idle.add("motor_inertia")
    result = []
    for p in machine.kind.parameters:
        std, value = machine.rel_std[p.name], machine.parameters[p.name]
        if std <= 0 or p.name in idle or value <= 0:
            continue
        low, high = max(p.lower, value / REACH), min(p.upper, value * REACH)
        log = p.name == STIFFNESS
        scale = 1.0 if log else value
        own = Unknown(p.name, p.place, value, scale, log, (low, high), std, force=_weighs(p.unit))
        result.append(replace(own, held=_held(machine, p.name)))
    return [*result, *_numerics_of_friction(machine)]


def _numerics_of_friction(machine: Machine) -> list[Unknown]:
    """How sgn is rounded at the guides, and at the pulleys of a machine that has any."""
    given, typical = machine.parameters, SMOOTH_SPEED
    bounds = (0.0, 20 * typical)
    own = PLACES[SMOOTHING]
    found = [Unknown(SMOOTHING, own, given[SMOOTHING], typical, False, bounds, 2.0)]
    ratio = next((p for p in machine.kind.parameters if p.name == AT_PULLEYS), None)
    if ratio:
        reach = (ratio.lower, ratio.upper)
        found.append(Unknown(ratio.name, ratio.place, given[ratio.name], 1.0, True, reach, OTHER))
    return found


def _effect_unknown(instance: Instance, k: int, parameter: EffectParameter) -> Unknown:
    start = next((s for s in parameter.starts if s), 1.0)
    scale = abs(start) if not parameter.periodic else 1.0
    log = parameter.log
    centre = abs(start) if log else parameter.neutral
    bounds = (parameter.lower, parameter.upper)
    if parameter.periodic:
        bounds = (-4 * parameter.periodic, 4 * parameter.periodic)
    if log and parameter.lower <= 0:
        bounds = (parameter.upper * 1e-6, parameter.upper)
    key = f"{instance.effect.name}.{instance.location}.{parameter.name}"
    wave = log and not parameter.size and any(p.periodic for p in instance.effect.parameters)
    force = _weighs(parameter.unit_at(instance.location))
    own = Unknown(key, instance.parameter + k, centre, scale, log, bounds, wave=wave, force=force)
    ends = [own.internal(value) for value in parameter.forms]
    return replace(own, span=float(np.ptp(ends))) if ends else own


def effect_unknowns(
    instance: Instance,
    drive: str,
    runs: Sequence[str],
    shaped: bool = False,
    extent: Mapping[str, float] = ANY_EXTENT,
) -> list[Unknown]:
    """The parameters that one effect at one location has with a drive.

    What belongs to one recording is there once for each of ``runs``, as ``key@run``.  ``extent``:
    what the runs cover, by the unit of a count of waves; less than two waves are no wave.
    """
    found = []
    for k, p in enumerate(instance.effect.parameters):
        if drive in p.drives and not p.initial and (shaped or not p.shape):
            one = _effect_unknown(instance, k, p)
            if one.wave and p.unit in extent:
                low, high = one.bounds
                one = replace(one, bounds=(min(max(low, WAVES / extent[p.unit]), high), high))
            each = [replace(one, key=f"{one.key}@{name}", run=r) for r, name in enumerate(runs)]
            found += each if p.local else [one]
    return found


def frees_rotor(effects: list[Effect]) -> bool:
    """Whether any of these effects makes the motor angles degrees of freedom."""
    return any(e.frees_rotor for e in effects)
