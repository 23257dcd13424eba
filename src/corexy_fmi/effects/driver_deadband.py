"""The H-bridge gives nothing for small commands: a dead band in the voltage.

    V = V_c - clamp(V_c, -voltage, voltage)                                              [V]

Source: Tao, Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996.
"""

from corexy_fmi.effects.api import DC, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import clamp


def bridge(applied_voltage, voltage):
    """Voltage [V] that reaches the motor."""
    return {"applied_voltage": applied_voltage - clamp(applied_voltage, -voltage, voltage)}


EFFECT = Effect(
    name="driver_deadband",
    summary="dead band of the H-bridge",
    locations={"motors": (0, 1)},
    parameters=(
        Parameter("voltage", "V", "half of the dead band", 0.0, 0.0, 24.0, (0.2,), size=True),
    ),
    laws=(Law("motor", bridge),),
    equation=r"V = V_c - \mathrm{clamp}(V_c, -V_d, V_d)",
    citation="Tao, Kokotović 1996, Adaptive Control of Systems with Actuator and Sensor "
    "Nonlinearities",
    remedy="Shorten the bridge's dead time, raise its PWM resolution, or add the band in software.",
    check="Raise the voltage from zero slowly with the belts off: the current begins late.",
    looks_like="torque is missing by a constant whenever the voltage is on, as more dry friction",
    state="voltage",
    coordinate="motors",
    drives=(DC,),
    claims={"odd": True},
)
