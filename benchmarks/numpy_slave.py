"""A plain pythonfmu slave in numpy: the full stage of a bare stepper machine, nothing checked.

What the FMU would cost if its equations were array operations in Python; `fmu_cost.py` puts the
constants beside it.
"""

import math
from pathlib import Path

import numpy as np
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class NumpyStage(Fmi2Slave):
    """Leap-frog with set-valued Coulomb friction, as `fmu_src/native/stage.c` does it."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.phi1 = self.phi2 = self.phi1_rate = self.phi2_rate = self.x = self.y = 0.0
        for name in ("phi1", "phi2", "phi1_rate", "phi2_rate"):
            self.register_variable(Real(name, causality=Fmi2Causality.input, start=0.0))
        for name in ("x", "y"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def enter_initialization_mode(self):
        """Read the constants: rest at the origin."""
        with np.load(Path(self.resources) / "numpy_stage.npz") as table:
            self.rows, self.stiffness = table["rows"], table["stiffness"]
            self.mass, self.viscous = table["mass"], table["viscous"]
            self.coulomb, self.limit = table["coulomb"], float(table["limit"])
        self.q, self.v = np.zeros(12), np.zeros(12)

    def do_step(self, current_time, step_size):
        """Whole micro-steps."""
        count = max(math.ceil(step_size / self.limit - 1e-9), 1)
        h = step_size / count
        half = 0.5 * h
        b = half * self.viscous / self.mass
        keep, push = (1 - b) / (1 + b), h / self.mass / (1 + b)
        slip = push * self.coulomb
        angles = np.array([self.phi1, self.phi2])
        rates = np.array([self.phi1_rate, self.phi2_rate])
        q, v = self.q, self.v
        for n in range(count):
            q = q + half * v
            q[2:4] = angles + rates * ((n + 0.5) * h)
            force = -self.rows.T @ (self.stiffness * (self.rows @ q))
            fast = keep * v + push * force
            v = fast - np.copysign(np.minimum(np.abs(fast), slip), fast)
            v[2:4] = rates
            q = q + half * v
        self.q, self.v = q, v
        self.x, self.y = float(q[0]), float(q[1])
        return True
