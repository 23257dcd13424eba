"""What holds a stage against a force, how far friction holds its belts deflected, and how far off
its even course a stage may be that is met in motion.
"""

from __future__ import annotations

import numpy as np

from corexy_fmi.kernel.call import Array, Excitation
from corexy_fmi.machine import Machine
from corexy_fmi.topologies import COREXY
from corexy_fmi.topology import STAGES


def deflection_scale(machine: Machine) -> float:
    """Half of the deflection [m] at which stiction holds the stage against its belts."""
    constants = STAGES[like(machine)].constants(machine.parameters, float(machine.drive == "dc"))
    return 0.5 * float(max(constants.coulomb[:2])) / holding_stiffness(machine) + 1e-9


def holding_stiffness(machine: Machine) -> float:
    """What holds an axis [N/m] against a force: the belts, eq. (15); without any, the loop."""
    stage = STAGES[like(machine)]
    if stage.sections:
        constants = stage.constants(machine.parameters, float(machine.drive == "dc"))
        return 2 * float(constants.stiffness[0])
    kp = machine.controller.kp if machine.controller else 1.0
    return machine.at("motor_torque_gain") * kp / machine.parameters["pulley_radius"] ** 2


def rotor_scale(machine: Machine, e: Excitation) -> float:
    """Half of the angle [rad] off its command at which stiction, its own and that of an axis, holds
    a rotor against its loop; 0 without one, or where a run begins in motion.
    """
    if e.mode != "closed_loop" or e.kp <= 0 or e.lead > 0:
        return 0.0
    dry = STAGES[like(machine)].constants(machine.parameters, 1.0).coulomb
    torque = max(dry[2:4]) + machine.parameters["pulley_radius"] / 2 * max(dry[:2])
    return 0.5 * float(torque) / (machine.at("motor_torque_gain") * e.kp) + 1e-9


def rest_scale(machine: Machine, e: Excitation) -> Array:
    """Scale (6,) of what a run begins with (`REST`)."""
    return np.repeat([deflection_scale(machine), 1.0, rotor_scale(machine, e)], 2)


def push_scale(machine: Machine, pace: float) -> Array:
    """Scale (8,) of a push (`PUSH`) at a pace [m/s]: that, and how far the belts give where it is
    stopped at once.
    """
    stage = STAGES[like(machine)]
    masses = stage.constants(machine.parameters, float(machine.drive == "dc")).mass[:2]
    stiff = holding_stiffness(machine)
    give = pace * float(np.sqrt(max(masses) / stiff)) + deflection_scale(machine)
    ends = np.array([1.0, 1.0, *2 * [1 / machine.parameters["pulley_radius"]]])
    return np.concatenate([give * ends, pace * ends])


def speeds(machine: Machine, e: Excitation) -> Array:
    """Speed (rows - 1,) [m/s] that each interval of the inputs commands."""
    path = STAGES[machine.stage].path(machine.parameters["pulley_radius"], e.input1, e.input2)
    return np.asarray(np.hypot(*np.diff(path, axis=1)) / np.diff(e.time))


def like(machine: Machine) -> str:
    """The stage that tells how stiff a machine is."""
    return "reduced" if machine.topology == COREXY else machine.stage
