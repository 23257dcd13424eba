"""Where a stage rests that something pulls: off as far as forces of the place exceed friction.

A stage that leans, or whose cable pulls, did so before its recording: it begins where belts, and a
loop that holds its rotors, bear what stiction does not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from inspect import signature

import numpy as np

from corexy_fmi.engine.fitting.holding import holding_stiffness
from corexy_fmi.kernel.call import REST, Array, Excitation
from corexy_fmi.kernel.layout import Instance
from corexy_fmi.machine import Machine
from corexy_fmi.topology import STAGES

KNOWN = {"applied_force", "position"}  # what a law may read that pulls at rest
DRY = ("carriage_coulomb_friction", "bridge_coulomb_friction")
STIFF, RIM = "belt_axial_stiffness", "pulley_coulomb_friction"


@dataclass(frozen=True)
class Pull:
    """A force of the place alone, along one axis (0: x, 1: y); ``at``: its parameters' places in
    the kernel's vector.
    """

    function: Callable[..., Mapping[str, object]]
    axis: int
    at: Mapping[str, int]
    reads: tuple[str, ...]

    def force(self, vectors: Array, place: Array) -> Array:
        """Force (sets,) [N] of vectors (sets, n) at a place (2,) [m]."""
        given = {"applied_force": np.zeros(len(vectors)), "position": place[self.axis]}
        given |= {name: vectors[:, index] for name, index in self.at.items()}
        found = self.function(**{name: given[name] for name in self.reads})["applied_force"]
        return np.broadcast_to(np.asarray(found, np.float64), len(vectors))


def pulls(instances: Sequence[Instance]) -> tuple[Pull, ...]:
    """The forces of some effects that act at rest."""
    return tuple(pull for instance in instances for pull in _of(instance))


def _of(instance: Instance) -> Iterator[Pull]:
    effect, first = instance.effect, instance.parameter
    at = {p.name: first + k for k, p in enumerate(effect.parameters)}
    for law in effect.laws:
        reads = tuple(signature(law.function).parameters)
        if law.port == "guide" and "applied_force" in reads and set(reads) <= KNOWN | set(at):
            for axis in effect.locations[instance.location]:
                if law.applies(instance.location, axis):
                    yield Pull(law.function, axis, {n: at[n] for n in reads if n in at}, reads)


def leaning(
    found: Sequence[Pull], machine: Machine, e: Excitation, vectors: Array, rotors: bool
) -> Array:
    """How far off a run begins at rest under these pulls, (sets, 6) as `REST`; ``rotors``: a loop
    holds them.  Nothing where stiction holds, nor where nothing would.
    """
    off, stage = np.zeros((len(vectors), len(REST))), STAGES[machine.stage]
    looped = e.mode == "closed_loop" and e.kp > 0
    if not (stage.sections or looped):
        return off
    radius, value = machine.parameters["pulley_radius"], _values(machine, vectors)
    place = np.array(stage.path(radius, *e.start()))
    force = np.zeros((len(vectors), 2))
    for pull in found:
        force[:, pull.axis] += pull.force(vectors, place)
    borne = _beyond(force, np.column_stack([value(name) for name in DRY]))
    stiffer = value(STIFF) / machine.parameters[STIFF] if stage.sections else 1.0
    off[:, :2] = borne / np.reshape(holding_stiffness(machine) * stiffer, (-1, 1))
    if rotors and looped:
        turning = _beyond(borne @ np.array(stage.rest) * radius, value(RIM)[:, None])
        off[:, 4:] = turning / (value("motor_torque_gain")[:, None] * e.kp)
    return off


def _values(machine: Machine, vectors: Array) -> Callable[[str], Array]:
    """What gives a nominal parameter of all sets, (sets,); 0 for what the machine has not."""
    places = {p.name: p.place for p in machine.kind.parameters}
    none = np.zeros(len(vectors))
    return lambda name: vectors[:, places[name]] if name in places else none


def _beyond(load: Array, held: Array) -> Array:
    """What of a load (sets, 2) is beyond what is held, either way."""
    return load - np.clip(load, -held, held)
