"""What an effect file declares: its laws, parameters, places and what a user should do about it.

An effect is one file with a module constant ``EFFECT``.  Its physics is one or more ordinary
functions of named variables of a port (`corexy_fmi.kernel.ports`), of its own memory and of its
parameters; a law returns a dict of the variables it changes.  The same function runs on floats and
arrays (the Python reference) and is traced once with SymPy (C, LaTeX).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from inspect import signature

AXES = {"x": (0,), "y": (1,), "xy": (0, 1)}
MOTORS = {"motor1": (0,), "motor2": (1,), "motors": (0, 1)}
BELTS = {"belts": tuple(range(12))}
SENSOR = {"sensor": (0,)}
STEPPER, DC = "stepper", "dc"
DYNAMIC = ("full", "reduced", "condensed")
EVERYWHERE = (*DYNAMIC, "kinematic")
ROTOR_TEETH = 50  # of a stepper motor with steps of 1.8 degrees: electrical cycles a turn
TWO_PI = 6.283185307179586
PHASES = (0.0, TWO_PI / 4)  # starts of a phase: together they span a wave


@dataclass(frozen=True)
class Parameter:
    """One number of an effect, with its unit, its neutral value and the range that physics allows.

    ``starts`` are the values from which a fit begins; ``size`` marks the one parameter whose
    neutral value switches the effect off.  ``log`` parameters are fitted on a logarithmic scale.
    ``scaling`` says how a small effect grows with its size: 1 in proportion, -1 as its inverse,
    0 neither.  Where several are marked ``size``, the effect is off with all of them neutral.
    ``over`` ("time", "position" or "frequency") lets a fit begin all over the range of the
    recordings instead of at ``starts``; on ``drives`` beside those named it stays as it is.
    "threshold": beyond some value there is no effect at all; ``starts`` only find it.  ``heard``: a
    fit begins at the strongest tones of the recordings' mismatch, too.
    """

    name: str
    unit: str
    meaning: str
    neutral: float
    lower: float
    upper: float
    starts: tuple[float, ...]
    size: bool = False
    log: bool = False
    scaling: int = 1
    periodic: float = 0.0
    default: float | None = None  # value where a machine file leaves it out; None: must be given
    over: str = ""
    heard: bool = False  # a frequency at which the mismatch may ring
    local: bool = False  # belongs to one recording: each has its own value
    begins: bool = False  # a time: at its upper bound nothing changes while it is recorded
    initial: bool = False  # where a memory begins, -1 .. 1: free in every run, told of none
    drives: tuple[str, ...] = (STEPPER, DC)
    units: Mapping[str, str] = field(default_factory=dict)  # by location, where they differ
    shape: bool = False  # stays at its default unless a hypothesis says that it is fitted too
    whole: bool = False  # a count: fitted as any number, then held near a whole one
    family_ends: bool = False  # beyond its upper bound lies another cause (engine/places/family.py)
    forms: tuple[float, ...] = ()  # values at which the law is one of the literature's

    def unit_at(self, location: str) -> str:
        """The unit at a location."""
        return self.units.get(location, self.unit)

    @property
    def unit_anywhere(self) -> str:
        """The unit, of all locations where they differ: N or N m."""
        return " or ".join(dict.fromkeys([self.unit, *self.units.values()]))


def overtones(of: str) -> tuple[Parameter, Parameter]:
    """Sine and cosine of a wave's overtone, as shares of the wave; ``of``: what they turn with."""
    sine, cosine = (
        Parameter(
            f"overtone_{name}",
            "1",
            f"{name} of {of}, over the amplitude",
            0.0,
            -1.0,
            1.0,
            (0.0,),
            default=0.0,
        )
        for name in ("sine", "cosine")
    )
    return sine, cosine


def share(
    name: str,
    meaning: str,
    starts: tuple[float, ...] = (0.0, 1.0),
    default: float = 0.0,
    upper: float = 1.0,
) -> Parameter:
    """The share of one of the literature's laws against another: 0 and 1 are laws of their own."""
    ends = (0.0, 1.0)
    return Parameter(name, "1", meaning, default, 0.0, upper, starts, default=default, forms=ends)


@dataclass(frozen=True)
class Law:
    """One function at one port; the function's argument names say what it reads."""

    port: str
    function: Callable[..., Mapping[str, object]]
    places: tuple[int, ...] | None = None  # where it applies, of the location's; None: everywhere
    locations: tuple[str, ...] | None = None  # the same by the location's name
    drives: tuple[str, ...] = (STEPPER, DC)

    def applies(self, location: str, place: int) -> bool:
        """Whether it acts at a place of a location."""
        here = self.locations is None or location in self.locations
        return here and (self.places is None or place in self.places)


@dataclass(frozen=True)
class Effect:
    """One physical effect of the catalogue (CONTRACT 5)."""

    name: str
    summary: str
    locations: Mapping[str, tuple[int, ...]]
    parameters: tuple[Parameter, ...]
    laws: tuple[Law, ...]
    equation: str  # LaTeX
    citation: str
    remedy: str
    check: str
    looks_like: str
    state: str  # located.state of CONTRACT 4
    coordinate: str | None = None  # located.coordinate where it is not the location itself
    drives: tuple[str, ...] = (STEPPER, DC)
    fidelities: tuple[str, ...] = DYNAMIC
    memory: tuple[str, ...] = ()  # names of the scalars it remembers for each place
    shared: bool = False  # all places share one memory: a coordinate of its own
    frees_rotor: bool = False  # the motor angle becomes a degree of freedom (stepper)
    history: float = 0.0  # [s] of sensor history that it looks back
    # square [1/s^2] of its fastest pole, of its parameters, rotor_inertia, carriage and bridge
    # (moving masses), span_stiffness (of a section beside the bridge) and spacing (of its ends)
    pole: Callable[..., object] | None = None
    claims: Mapping[str, bool] = field(default_factory=dict)  # "odd", "dissipative"

    def initial_at(self, location: str) -> tuple[int, ...]:
        """Indices of the parameters that say where a memory begins at a location."""
        acting = [
            law
            for law in self.laws
            if any(law.applies(location, place) for place in self.locations[location])
        ]
        read = {name for law in acting for name in signature(law.function).parameters}
        return tuple(k for k, p in enumerate(self.parameters) if p.initial and p.name in read)

    @property
    def size(self) -> Parameter:
        """The parameter whose neutral value switches the effect off."""
        return self.sizes[0]

    @property
    def sizes(self) -> tuple[Parameter, ...]:
        """All parameters whose neutral values together switch the effect off."""
        return tuple(p for p in self.parameters if p.size)

    def neutral(self) -> dict[str, float]:
        """Parameter values at which the effect is exactly absent."""
        return {p.name: p.neutral for p in self.parameters}
