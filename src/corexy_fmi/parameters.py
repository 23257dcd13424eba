"""The nominal parameters of the paper's model: unit, value of `yin2018`, bounds and prior.

The values are parameter set P1, a surrogate: the table of the paper (Table I) did not reach us.
"""

from __future__ import annotations

from dataclasses import dataclass

LOOSE, FIXED = 0.2, 0.0  # [1] prior, one sigma relative to the value; 0 holds it fixed


@dataclass(frozen=True)
class NominalParameter:
    """One number of the nominal model.

    ``default`` is the stepper machine's value, ``dc_default`` the dc machine's where it differs;
    ``rel_std`` is the relative prior of a bare number; bounds are inclusive and in ``unit``.
    ``slot`` names the place in the kernel's vector that another topology puts it at.
    """

    name: str
    symbol: str
    unit: str
    default: float
    lower: float
    upper: float
    rel_std: float
    meaning: str
    fmu_name: str
    dc_default: float | None = None
    slot: str = ""

    @property
    def place(self) -> int:
        """Place in the kernel's vector."""
        return PLACES[self.slot or self.name]

    def value(self, drive: str) -> float:
        """Default for a drive, "stepper" or "dc"."""
        return self.dc_default if drive == "dc" and self.dc_default is not None else self.default


NOMINAL: tuple[NominalParameter, ...] = (
    NominalParameter("pulley_radius", "r", "m", 5.0e-3, 1e-3, 0.1, FIXED,
                     "pitch radius of all pulleys", "pulley.radius"),
    NominalParameter("carriage_mass", "m_x", "kg", 0.10, 1e-3, 100.0, LOOSE,
                     "mass of the carriage with its tool", "carriage.mass"),
    NominalParameter("bridge_mass", "m_y", "kg", 0.20, 1e-3, 200.0, LOOSE,
                     "mass of the bridge, without carriage and pulleys", "bridge.mass"),
    NominalParameter("pulley_mass", "m_p", "kg", 6e-3, 0.0, 5.0, LOOSE,
                     "mass of one pulley on the bridge", "pulley.mass"),
    NominalParameter("pulley_inertia", "J_p", "kg m^2", 1.0e-7, 1e-10, 0.1, LOOSE,
                     "inertia of one idler", "pulley.inertia"),
    NominalParameter("motor_inertia", "J_1, J_2", "kg m^2", 5.4e-6, 1e-9, 1.0, LOOSE,
                     "inertia of a rotor with its driving pulley", "motor.inertia", 2.1e-5),
    NominalParameter("belt_axial_stiffness", "A E", "N", 880.0, 10.0, 1e7, LOOSE,
                     "stiffness of the belt times its length", "belt.axialStiffness"),
    NominalParameter("bridge_pulley_spacing", "W", "m", 0.24, 0.02, 10.0, FIXED,
                     "spacing of the bridge's pulleys; l_4 = W", "bridge.pulleySpacing"),
    NominalParameter("motor_idler_span", "H", "m", 0.30, 0.02, 10.0, FIXED,
                     "motor to far idler; l_3 = H, l_2 = l_5 = H/2 at y = 0",
                     "frame.motorIdlerSpan"),
    NominalParameter("clip_spacing", "c", "m", 0.06, 0.0, 5.0, FIXED,
                     "belt clip to belt clip; l_1 = (W - c)/2 at x = 0", "carriage.clipSpacing"),
    NominalParameter("belt_damping_time", "c_i / k_i", "s", 0.0, 0.0, 0.1, FIXED,
                     "material damping of a section over its stiffness", "belt.dampingTime"),
    NominalParameter("carriage_viscous_friction", "b_1", "N s/m", 60.0, 0.0, 1e4, LOOSE,
                     "viscous friction of the carriage", "carriage.viscousFriction"),
    NominalParameter("bridge_viscous_friction", "b_2", "N s/m", 60.0, 0.0, 1e4, LOOSE,
                     "viscous friction of the bridge", "bridge.viscousFriction"),
    NominalParameter("carriage_coulomb_friction", "f_1", "N", 0.2, 0.0, 1e3, LOOSE,
                     "Coulomb friction of the carriage", "carriage.coulombFriction"),
    NominalParameter("bridge_coulomb_friction", "f_2", "N", 0.2, 0.0, 1e3, LOOSE,
                     "Coulomb friction of the bridge", "bridge.coulombFriction"),
    NominalParameter("pulley_viscous_friction", "B_p", "N m s/rad", 8.0e-4, 0.0, 1.0, LOOSE,
                     "viscous friction of every pulley", "pulley.viscousFriction"),
    NominalParameter("pulley_coulomb_friction", "tau_f", "N m", 2e-4, 0.0, 10.0, LOOSE,
                     "Coulomb friction of every pulley", "pulley.coulombFriction"),
    NominalParameter("motor_torque_gain", "K_1", "N m/V", 0.095, 1e-6, 1e3, LOOSE,
                     "torque of a dc motor per volt", "motor.torqueGain"),
    NominalParameter("motor_damping_gain", "K_2", "N m s/rad", 3.1e-3, 0.0, 1e2, LOOSE,
                     "back-EMF damping of a dc motor", "motor.dampingGain"),
    NominalParameter("friction_smoothing", "v_s", "m/s", 0.0, 0.0, 0.05, FIXED,
                     "speed scale of smooth Coulomb friction (nearly tanh); 0: set-valued",
                     "friction.smoothingSpeed"),
    NominalParameter("pulley_smoothing_ratio", "v_p / v_s", "1", 1.0, 0.02, 50.0, FIXED,
                     "speed scale of smooth friction at the pulleys' rims over that of the guides",
                     "friction.pulleySmoothingRatio"),
)  # fmt: skip

NUMERICS = ("friction_smoothing", "pulley_smoothing_ratio")  # of sgn: no property of a machine
BY_NAME: dict[str, NominalParameter] = {parameter.name: parameter for parameter in NOMINAL}
PLACES: dict[str, int] = {parameter.name: n for n, parameter in enumerate(NOMINAL)}


def nominal(name: str) -> NominalParameter:
    """The parameter of that name; raises KeyError for an unknown one."""
    return BY_NAME[name]


def defaults(drive: str) -> dict[str, float]:
    """Value of every parameter in `yin2018` with that drive, "stepper" or "dc"."""
    return {parameter.name: parameter.value(drive) for parameter in NOMINAL}


def priors() -> dict[str, float]:
    """Relative prior [1] of every parameter given as a bare number."""
    return {parameter.name: parameter.rel_std for parameter in NOMINAL}
