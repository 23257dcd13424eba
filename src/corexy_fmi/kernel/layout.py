"""Where each parameter and each memory of the kernel lies: one flat vector for each lane."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from corexy_fmi.effects import catalogue
from corexy_fmi.effects.api import Effect
from corexy_fmi.kernel.law_code import check_laws
from corexy_fmi.machine.laws import ARGUMENTS
from corexy_fmi.parameters import NOMINAL

FREE_FORM_LOCATIONS = ("x", "y", "motor1", "motor2")
LAW_KINDS = tuple((acts, name) for acts, names in ARGUMENTS.items() for name in names)
KNOTS = 24
KIND, COUNT, VISCOUS, ONSET, FIRST_KNOT = range(5)  # of a free-form law
FIRST_VALUE = FIRST_KNOT + KNOTS
FREE_FORM_SIZE = FIRST_VALUE + KNOTS


def free_form_vector(
    kind: int,
    knots: Sequence[float],
    values: Sequence[float],
    viscous: float = 0.0,
    onset: float = 0.0,
) -> list[float]:
    """What a free-form law holds in the kernel's vector, (FREE_FORM_SIZE,)."""
    rest = [0.0] * (KNOTS - len(knots))
    return [kind, len(knots), viscous, onset, *knots, *rest, *values, *rest]


@dataclass(frozen=True, eq=False)
class Instance:
    """One effect at one location: its offsets into the parameter and memory vectors."""

    effect: Effect
    location: str
    parameter: int
    memory: int

    @property
    def places(self) -> tuple[int, ...]:
        """Places of the ports that this instance covers."""
        return self.effect.locations[self.location]

    @property
    def memory_step(self) -> int:
        """From the memory of one place to that of the next."""
        return 0 if self.effect.shared else len(self.effect.memory)


@dataclass(frozen=True, eq=False)
class Layout:
    """The vector: nominal parameters, then each instance's, then the free-form laws."""

    instances: tuple[Instance, ...]
    free_form: int
    parameters: int
    memories: int

    def find(self, name: str, location: str) -> Instance:
        """The instance of an effect at a location; KeyError where there is none."""
        for instance in self.instances:
            if instance.effect.name == name and instance.location == location:
                return instance
        raise KeyError((name, location))


def nominal_index(name: str) -> int:
    """Place of a nominal parameter in the vector."""
    return [p.name for p in NOMINAL].index(name)


def make_layout(effects: Mapping[str, Effect]) -> Layout:
    """Lay out the given effects, in their order.

    Raises InputError for a law of an effect that is not bundled and cannot be traced.
    """
    instances, parameter, memory = [], len(NOMINAL), 0
    bundled = catalogue()
    for effect in effects.values():
        if bundled.get(effect.name) is not effect:
            check_laws(effect)
    for effect in effects.values():
        for location, places in effect.locations.items():
            instances.append(Instance(effect, location, parameter, memory))
            parameter += len(effect.parameters)
            memory += len(effect.memory) * (1 if effect.shared else len(places))
    total = parameter + len(FREE_FORM_LOCATIONS) * FREE_FORM_SIZE
    return Layout(tuple(instances), parameter, total, memory)


@cache
def bundled_layout() -> Layout:
    """Layout of the bundled catalogue."""
    return make_layout(catalogue())


def layout_with(own: dict[str, Effect]) -> Layout:
    """The bundled layout, or with a user's own effects beside the catalogue's."""
    return make_layout(catalogue() | own) if own else bundled_layout()
