"""What holds a stage against a force, and how far friction holds its belts deflected."""

from __future__ import annotations

from corexy_fmi.machine import Machine
from corexy_fmi.topologies import COREXY
from corexy_fmi.topology import STAGES


def deflection_scale(machine: Machine) -> float:
    """Half of the deflection [m] at which stiction holds the stage against its belts."""
    constants = STAGES[_like(machine)].constants(machine.parameters, float(machine.drive == "dc"))
    return 0.5 * float(max(constants.coulomb[:2])) / holding_stiffness(machine) + 1e-9


def holding_stiffness(machine: Machine) -> float:
    """What holds an axis [N/m] against a force: the belts, eq. (15); without any, the loop."""
    stage = STAGES[_like(machine)]
    if stage.sections:
        constants = stage.constants(machine.parameters, float(machine.drive == "dc"))
        return 2 * float(constants.stiffness[0])
    kp = machine.controller.kp if machine.controller else 1.0
    return machine.at("motor_torque_gain") * kp / machine.parameters["pulley_radius"] ** 2


def _like(machine: Machine) -> str:
    """The stage that tells how stiff a machine is."""
    return "reduced" if machine.topology == COREXY else machine.stage
