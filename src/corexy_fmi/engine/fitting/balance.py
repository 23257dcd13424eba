"""How far a pull may hold a stage off at its first row: forces of the place alone, beyond stiction.

A stage that leans, or whose cable pulls, may have done so before its recording: then it rests where
belts, and a loop that holds its rotors, bear that.  Or it is let go at its first row, at eq. (1).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from inspect import signature

import numpy as np

from corexy_fmi.engine.fitting.holding import like
from corexy_fmi.kernel.call import REST, Array, Excitation
from corexy_fmi.kernel.layout import Instance
from corexy_fmi.machine import Machine
from corexy_fmi.parameters import PLACES
from corexy_fmi.topology import STAGES

KNOWN = {"applied_force", "position"}  # what a law may read that pulls at rest
# places in the kernel's vector, whatever a topology calls them
DRY = [PLACES["carriage_coulomb_friction"], PLACES["bridge_coulomb_friction"]]
STIFF, RIM, GAIN = (
    PLACES[name]
    for name in ("belt_axial_stiffness", "pulley_coulomb_friction", "motor_torque_gain")
)


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
    found: Sequence[Pull], machine: Machine, e: Excitation, vectors: Array, base: Array
) -> Array:
    """How far these pulls may hold off a run that begins at rest, (sets, 6) as `REST`; ``base``
    (n,) is the machine's own vector.  Nothing where stiction holds, nor where motors are axes.
    """
    off, stage = np.zeros((len(vectors), len(REST))), STAGES[machine.stage]
    if any(stage.direct):
        return off
    radius = machine.parameters["pulley_radius"]
    place = np.array(stage.path(radius, *e.start()))
    force = np.zeros((len(vectors), 2))
    for pull in found:
        force[:, pull.axis] += pull.force(vectors, place)
    borne = _borne(force, vectors[:, DRY])
    stiffer = vectors[:, STIFF] / base[STIFF]
    off[:, :2] = np.abs(borne) / (stiffness(machine) * stiffer[:, None])
    if e.mode == "closed_loop" and e.kp > 0:
        turning = _borne(borne @ np.array(stage.rest) * radius, vectors[:, [RIM]])
        off[:, 4:] = np.abs(turning) / (vectors[:, [GAIN]] * e.kp)
    return off


def stiffness(machine: Machine) -> Array:
    """What the belts hold x and y with, (2,) [N/m], motors and all else held."""
    stage = STAGES[like(machine)]
    return np.diag(stage.stiffness_matrix(machine.parameters, machine.drive == "dc"))[:2]


def _borne(load: Array, dry: Array) -> Array:
    """What belts or a loop bear of a load (sets, 2) at rest: nothing where stiction holds it, all
    where a stage that was let go has sprung to its balance, give or take stiction.
    """
    size = np.abs(load)
    return np.sign(load) * np.minimum(size, 2 * np.maximum(size - dry, 0.0))
