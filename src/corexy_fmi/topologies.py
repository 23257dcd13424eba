"""What a machine file may call its topology: parameters, motors, and the effects that fit it.

The kernel's vector has one place for each parameter of the Core-XY stage; another topology puts its
own parameters there (`NominalParameter.slot`) and reads no other place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from corexy_fmi.effects.api import Effect, Law
from corexy_fmi.parameters import BY_NAME, FIXED, LOOSE, NOMINAL, NominalParameter

COREXY = "corexy"
GUIDES = frozenset({"start", "start_axis", "guide", "stick"})
VOLTAGES = frozenset({"rotor", "motor", "torque"})
SENSORS = frozenset({"start_sensor", "output", "filter", "sensor", "sampling", "clock"})
BY_EQUATION_1 = (COREXY, "h_frame")  # whose motors turn by the sum and difference of x and y
BOTH_AXES = ("axis_skew", "sensor_rotation")


@dataclass(frozen=True)
class Topology:
    """A kind of stage.

    ``motors`` is how many there are; ``drives`` and ``fidelities`` what a machine file may choose;
    ``ports`` and ``locations`` say which effects of the catalogue mean something on it, without
    ``strange`` ones; free-form laws act on ``forces`` over ``arguments``.  Core-XY's effects name
    their fidelities themselves.
    """

    name: str
    parameters: tuple[NominalParameter, ...]
    motors: int = 2
    drives: tuple[str, ...] = ("stepper", "dc")
    fidelities: tuple[str, ...] = ("full",)
    ports: frozenset[str] = frozenset()
    locations: tuple[str, ...] = ()
    strange: tuple[str, ...] = ()
    forces: tuple[str, ...] = ("x", "y", "motor1", "motor2")
    arguments: tuple[str, ...] = ("vx", "vy", "x", "y", "phi1", "phi2", "t")

    def stage(self, fidelity: str) -> str:
        """Name of the kernel's stage."""
        return fidelity if self.name == COREXY else self.name

    def knows(self, effect: Effect, location: str) -> bool:
        """Whether an effect at a location means something on this stage, whatever the drive."""
        fits = location in self.locations and effect.name not in self.strange
        return fits and all(law.port in self.ports for law in _laws(effect, location))


def _laws(effect: Effect, location: str) -> list[Law]:
    places = effect.locations[location]
    return [law for law in effect.laws if any(law.applies(location, p) for p in places)]


def _own(
    like: str,
    name: str,
    symbol: str,
    unit: str,
    value: float,
    meaning: str,
    rel_std: float = LOOSE,
) -> NominalParameter:
    """A parameter at the place of a Core-XY one, with its bounds."""
    given = replace(BY_NAME[like], name=name, symbol=symbol, unit=unit, default=value)
    return replace(given, meaning=meaning, slot=like, rel_std=rel_std, fmu_name="", dc_default=None)


RADIUS = replace(
    _own("pulley_radius", "pulley_radius", "r", "m", 1.0,
         "travel per radian of the motor; 1: angles are travel in m, torques forces in N", FIXED),
    upper=1.0,
)  # fmt: skip
SMOOTHING = BY_NAME["friction_smoothing"]
GAIN = _own("motor_torque_gain", "force_gain", "g", "N m/V", 1.0,
            "torque per volt; force per volt where pulley_radius is 1")  # fmt: skip
SINGLE_AXIS = Topology(
    "single_axis",
    (
        RADIUS,
        _own("carriage_mass", "moving_mass", "M", "kg", 1.0, "all that moves, motor included"),
        _own("carriage_viscous_friction", "viscous_friction", "F_v", "N s/m", 1.0,
             "viscous friction, back-EMF included"),
        _own("carriage_coulomb_friction", "coulomb_friction", "F_c", "N", 0.1, "Coulomb friction"),
        GAIN,
        SMOOTHING,
    ),
    motors=1,
    drives=("dc",),
    ports=GUIDES | VOLTAGES | SENSORS,
    locations=("x", "motors", "sensor"),
    strange=(*BOTH_AXES, "load_friction"),
    forces=("x",),
    arguments=("vx", "x", "t"),
)  # fmt: skip
TWO_MASS = Topology(
    "two_mass",
    (
        RADIUS,
        _own("carriage_mass", "mass_1", "m_1", "kg", 1.0, "the driven cart, motor included"),
        _own("bridge_mass", "mass_2", "m_2", "kg", 1.0, "the sprung cart"),
        _own("belt_axial_stiffness", "spring_stiffness", "k", "N/m", 1e3, "between the carts"),
        replace(
            _own("pulley_viscous_friction", "spring_damping", "c", "N s/m", 0.5,
                 "between the carts"),
            upper=1e3,
        ),
        _own("carriage_viscous_friction", "viscous_friction_1", "b_1", "N s/m", 1.0,
             "of the driven cart, back-EMF included"),
        _own("bridge_viscous_friction", "viscous_friction_2", "b_2", "N s/m", 0.1,
             "of the sprung cart"),
        _own("carriage_coulomb_friction", "coulomb_friction_1", "f_1", "N", 0.1,
             "of the driven cart"),
        _own("bridge_coulomb_friction", "coulomb_friction_2", "f_2", "N", 0.01,
             "of the sprung cart"),
        GAIN,
        SMOOTHING,
    ),
    motors=1,
    drives=("dc",),
    ports=GUIDES | VOLTAGES | SENSORS,
    locations=("x", "y", "xy", "motors", "sensor"),
    strange=(*BOTH_AXES, "load_friction"),
    forces=("x", "y"),
    arguments=("vx", "vy", "x", "y", "t"),
)  # fmt: skip
PLANAR = tuple(
    p for p in NOMINAL if p.name not in ("pulley_inertia", "pulley_viscous_friction",
                                         "pulley_coulomb_friction", "pulley_mass", "clip_spacing",
                                         "pulley_smoothing_ratio")
)  # fmt: skip
CARTESIAN = Topology(
    "cartesian",
    PLANAR,
    ports=GUIDES | VOLTAGES | SENSORS | {"command"},
    locations=("x", "y", "xy", "motor1", "motor2", "motors", "sensor"),
)
H_FRAME = replace(CARTESIAN, name="h_frame", parameters=(*PLANAR, BY_NAME["clip_spacing"]))
TOPOLOGIES = {
    topology.name: topology
    for topology in (
        Topology(COREXY, NOMINAL, fidelities=("full", "reduced", "kinematic", "condensed")),
        SINGLE_AXIS,
        TWO_MASS,
        CARTESIAN,
        H_FRAME,
    )
}


def bounds(place: int) -> tuple[float, float]:
    """Bounds of a place of the kernel's vector: those of every parameter that may stand there."""
    held = [p for t in TOPOLOGIES.values() for p in t.parameters if p.place == place]
    return min(p.lower for p in held), max(p.upper for p in held)


def knows(stage: str, effect: Effect, location: str) -> bool:
    """Whether the kernel's stage of that name knows an effect at a location."""
    if stage in TOPOLOGIES:
        return TOPOLOGIES[stage].knows(effect, location)
    return stage in effect.fidelities
