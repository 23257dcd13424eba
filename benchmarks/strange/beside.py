"""What may be beside the stage of `benchmarks/shop/stage.py`, in numbers.

Coordinates q = (x, y, phi_1 .. phi_10; yaw of the bridge [rad]; frame's x and y [m]; the tool's off
the carriage, x and y [m]).  Assumed:

- A frame of one mass in x and y carries motors, fixed idlers and guides on springs; x and y are
  relative to it, so that it is pushed by what pushes carriage and bridge, turned round.
- A tool's mass is a part of the carriage's.
- Bridge pulleys, W/2 off the middle, go along with a yaw; the carriage's place on the bridge does
  not change the inertia.  The yaw's damping ratio is of its guides' stiffness and its inertia.
- A rotor holds its pulley's inertia; B_p and tau_f of (7) act on it as on any pulley.
- A belt section has a dashpot of k times `damping`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

COUNT, YAW, FRAME, TOOL = 17, 12, 13, 15  # coordinates; the first ones of each body
POLES, COGS = 50, 200  # of magnetic spring and detent in a turn
ENDLESS = 1e9  # [N] of pretension


class Body(NamedTuple):
    """Mass [kg] (a yaw's: inertia [kg m^2]), frequency [Hz] on its own springs, damping ratio."""

    mass: float
    frequency: float
    ratio: float

    @property
    def stiffness(self) -> float:
        """Of its springs [N/m] (a yaw's: [N m/rad])."""
        return self.mass * (2 * np.pi * self.frequency) ** 2

    @property
    def drag(self) -> float:
        """Of its dashpots [N s/m] (a yaw's: [N m s/rad])."""
        return 2 * self.ratio * self.mass * 2 * np.pi * self.frequency


class Magnet(NamedTuple):
    """Of both steppers: holding torque [N m], inertia of the rotor [kg m^2], damping [N m s/rad] of
    its speed beyond the command's; detent torque [N m] and its phase [rad].
    """

    holding: float
    inertia: float
    damping: float
    detent: float = 0.0
    phase: float = 0.0


class Ripple(NamedTuple):
    """Of motors 1 and 2, what belts feel beyond the rotor's angle [rad]; periods a turn; phase."""

    swings: tuple[float, float]
    order: float
    phase: float


class Runout(NamedTuple):
    """Of an idler, 3 to 10: half of its run-out, peak to peak [m]; phase [rad]."""

    idler: int
    amplitude: float
    phase: float


EVEN, ROUND = Ripple((0.0, 0.0), 0.0, 0.0), Runout(3, 0.0, 0.0)


@dataclass(frozen=True)
class Beside:
    """By default nothing.  Belts: strength of k_i = A E / l_i(x, y); tangent stiffness more per
    strain [1]; pretension [N]; k (e + damping e'); Maxwell arm over k [1] and its time [s].  Guides
    of x and y: bristles [N/m], 0 for rigid ones; dry friction per load [1].
    """

    strength: float = 0.0
    hardening: float = 0.0
    pretension: float = ENDLESS
    damping: float = 0.0
    arm: float = 0.0
    relaxes: float = 1.0
    bristles: tuple[float, float] = (0.0, 0.0)
    loaded: tuple[float, float] = (0.0, 0.0)
    ripple: Ripple = EVEN
    runout: Runout = ROUND
    magnet: Magnet | None = None
    yaw: Body | None = None
    frame: Body | None = None
    tool: Body | None = None

    @property
    def free(self) -> list[int]:
        """Coordinates that no motor imposes."""
        return [j for j in range(COUNT) if self.magnet or j not in (2, 3)]
