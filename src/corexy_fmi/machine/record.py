"""What a machine is made of, as plain records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from corexy_fmi.parameters import PLACES
from corexy_fmi.topologies import TOPOLOGIES, Topology

FREE_FORM = "free_form"


@dataclass(frozen=True)
class Controller:
    """The loop that the harness closes around a dc machine: kp [V/rad], kd [V s/rad].

    ``rate_weight`` [1] is the share of the reference's rate that the damping sees: 1 damps the
    error, 0 the motor's speed alone.
    """

    kp: float
    kd: float
    rate_weight: float = 1.0

    @property
    def line(self) -> str:
        """As metadata of a recording name it."""
        weight = "" if self.rate_weight == 1.0 else f" rate_weight={self.rate_weight!r}"
        return f"pd kp={self.kp!r} kd={self.kd!r}{weight}"


@dataclass(frozen=True)
class EffectUse:
    """One effect of the catalogue at one location, with all its parameters in their units."""

    name: str
    location: str
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class FreeForm:
    """A law without a name: values [N or N m] over knots of the argument, linear between them.

    It ``acts`` as a force, or as a Coulomb friction [N] beside that of an axis, which may be
    ``viscous`` [s/m], too: it grows by that share with speed.  A law over time may begin at an
    ``onset`` [s]: its argument is the time since then.
    """

    location: str
    argument: str
    knots: tuple[float, ...]
    values: tuple[float, ...]
    acts: str = "force"
    viscous: float = 0.0
    onset: float = 0.0


@dataclass(frozen=True)
class Machine:
    """Everything that a model is made from.

    ``parameters`` and ``rel_std`` hold every parameter of its topology (`corexy_fmi.topologies`),
    in SI units and relative to the value; ``surrogate`` is non-empty where the numbers stand in for
    lost ones.
    """

    name: str
    parameters: Mapping[str, float]
    rel_std: Mapping[str, float]
    topology: str = "corexy"
    drive: str = "stepper"
    fidelity: str = "full"
    controller: Controller | None = None
    effects: tuple[EffectUse, ...] = ()
    free_forms: tuple[FreeForm, ...] = ()
    surrogate: str = ""

    @property
    def kind(self) -> Topology:
        """Its topology: parameters, motors, and the effects that fit it."""
        return TOPOLOGIES[self.topology]

    def at(self, place: str) -> float:
        """The parameter that stands where Core-XY has ``place`` in the kernel's vector, else 0."""
        held = {p.place: p.name for p in self.kind.parameters}
        name = held.get(PLACES[place])
        return self.parameters[name] if name else 0.0

    @property
    def stage(self) -> str:
        """Name of the kernel's stage."""
        return self.kind.stage(self.fidelity)
