"""What a machine is made of, as plain records."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

FREE_FORM = "free_form"


@dataclass(frozen=True)
class Controller:
    """The loop that the harness closes around a dc machine: kp [V/rad], kd [V s/rad]."""

    kp: float
    kd: float


@dataclass(frozen=True)
class EffectUse:
    """One effect of the catalogue at one location, with all its parameters in their units."""

    name: str
    location: str
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class FreeForm:
    """A law without a name: values [N or N m] over knots of the argument, linear between them."""

    location: str
    argument: str
    knots: tuple[float, ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class Machine:
    """Everything that a model is made from.

    ``parameters`` and ``rel_std`` hold every name of `corexy_fmi.parameters.NOMINAL`, in SI units
    and relative to the value; ``surrogate`` is non-empty where the numbers stand in for lost ones.
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
