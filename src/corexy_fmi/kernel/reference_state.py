"""What the Python reference is made of: arrays under the ports' names, and the active laws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.kernel.layout import Instance, Layout
from corexy_fmi.kernel.ports import COMMON, PORTS
from corexy_fmi.kernel.trace import argument_names
from corexy_fmi.parameters import NOMINAL
from corexy_fmi.topologies import knows
from corexy_fmi.topology import STAGES, Stage

Array = NDArray[np.float64]
SECTION_PORTS = ("start_section", "shape", "belt", "tension")


def _arrays(stage: Stage, nominal: Mapping[str, float], dc: bool) -> dict[str, Array]:
    """State and constants of a stage under the names that the port table uses."""
    n, sections = len(stage.coordinates), len(stage.sections)
    c = stage.constants(nominal, float(dc))
    held = nominal["belt_damping_time"] if c.damping_time is None else c.damping_time
    pairs = (
        "command",
        "command_rate",
        "voltage",
        "reported",
        "reported_velocity",
        "reported_acceleration",
        "acceleration",
    )
    return {name: np.zeros(2) for name in pairs} | {
        "q": np.zeros(n),
        "v": np.zeros(n),
        "before": np.zeros(n),
        "mass": np.array(c.mass, float),
        "damping0": np.array(c.viscous, float),
        "bound0": np.array(c.coulomb, float),
        "stiffness0": np.array(c.stiffness, float),
        "length0": np.array(c.length, float),
        "radius": np.array([nominal["pulley_radius"]]),
        "damping_time": np.array([float(held)]),
        "belt_sign": np.array([1.0 if s.belt == 1 else -1.0 for s in stage.sections]),
        "side": np.array([float(s.side) for s in stage.sections]),
        "yaw_arm": np.array([float(s.yaw_arm) for s in stage.sections]),
        "spacing": np.array([nominal["bridge_pulley_spacing"]]),
        "damping_gain": np.array([nominal["motor_damping_gain"]]),
        "back_emf": np.array([nominal["motor_damping_gain"] / nominal["motor_torque_gain"]]),
        "runout": np.zeros(10),
        "runout_slope": np.zeros(10),
        "offset": np.zeros(2),
        "tension": np.zeros(sections),
        "lateness": np.zeros(1),
    }


def _index(text: str, place: int) -> int:
    """Value of an index of the port table: a number, i, i + n or n - i."""
    first, sign, offset = text.partition(" + ")
    if " - " in text:
        return int(text.partition(" - ")[0]) - place
    return (place if first == "i" else int(first)) + (int(offset) if sign else 0)


class ReferenceState:
    """Arrays, memories and active laws of one lane."""

    def __init__(self, layout: Layout, vector: Array, fidelity: str, dc: bool) -> None:
        """``vector`` holds layout.parameters values."""
        self.layout, self.stage, self.dc, self.vector = layout, STAGES[fidelity], dc, vector
        self.nominal = {p.name: float(vector[i]) for i, p in enumerate(NOMINAL)}
        self.nominal |= {n: float(vector[i]) for i, n in enumerate(self.stage.names()) if n}
        self.direct = [i for i in (0, 1) if self.stage.direct[i]]
        self.radius = self.nominal["pulley_radius"]
        self.a = _arrays(self.stage, self.nominal, dc)
        self.row = self.stage.rows(1.0)
        self.slopes = np.array([s.length_slope for s in self.stage.sections], float).reshape(-1, 2)
        self.active = [i for i in layout.instances if self._is_on(i)]
        self.memory = {}
        for i in self.active:
            first = dict.fromkeys(i.effect.memory, 0.0)
            for place in i.places:
                own = first if i.effect.shared else dict(first)
                self.memory[i.effect.name, i.location, place] = own
        held = {place for i in self.active if i.effect.frees_rotor for place in i.places}
        self.released = np.array([dc or place in held for place in (0, 1)])
        self.now = self.elapsed = self.step = self.time = self.begun = 0.0

    def _values(self, instance: Instance) -> dict[str, float]:
        first = instance.parameter
        parameters = instance.effect.parameters
        return {p.name: float(self.vector[first + k]) for k, p in enumerate(parameters)}

    def _is_on(self, instance: Instance) -> bool:
        effect, drive = instance.effect, "dc" if self.dc else "stepper"
        values = self._values(instance)
        on = any(values[p.name] != p.neutral for p in effect.sizes)
        known = knows(self.stage.name, effect, instance.location)
        return on and drive in effect.drives and known

    def runs(self, port: str) -> bool:
        """Whether any active law acts at a port."""
        return any(
            law.applies(i.location, place)
            for i in self.active
            for law in i.effect.laws
            if law.port == port and ("dc" if self.dc else "stepper") in law.drives
            for place in i.places
        )

    def run_port(self, port: str) -> None:
        """Every active law of a port, at its places."""
        for instance in self.active:
            for law in instance.effect.laws:
                if law.port == port and ("dc" if self.dc else "stepper") in law.drives:
                    for place in instance.places:
                        if law.applies(instance.location, place):
                            self._apply(instance, law.function, port, place)

    def _exists(self, port: str, place: int) -> bool:
        if port in SECTION_PORTS:
            return place < len(self.stage.sections)
        return port != "runout" or place < len(self.a["q"]) - 2

    def _apply(
        self, instance: Instance, function: Callable[..., Any], port: str, place: int
    ) -> None:
        if not self._exists(port, place):
            return
        memory = self.memory[instance.effect.name, instance.location, place]
        values: dict[str, Any] = {**self._values(instance), **memory}
        values |= {name: getattr(self, source) for name, source in COMMON.items()}
        where: dict[str, tuple[Array, int]] = {}
        for name in {*argument_names(function), *PORTS[port].writes} & {*PORTS[port].variables}:
            source, index = PORTS[port].variables[name]
            where[name] = self.a[source], _index(index, place)
        values |= {name: float(array[at]) for name, (array, at) in where.items()}
        for name, value in function(**{n: values[n] for n in argument_names(function)}).items():
            if name in memory:
                memory[name] = float(value)
            else:
                array, at = where[name]
                array[at] = value
