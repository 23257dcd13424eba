"""The H-bridge gives nothing for small commands: a dead band in the voltage.

    V = 0 where |V_c| < voltage, else V_c - lost voltage sgn(V_c)                         [V]

A bridge's dead time loses the band at every voltage (lost = 1), a PWM of coarse resolution or a
least pulse only what lies within it (lost = 0).

Source: Tao, Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996.
"""

from corexy_fmi.effects.api import DC, Effect, Law, Parameter, share
from corexy_fmi.kernel.xmath import absolute, clamp, select


def bridge(applied_voltage, voltage, lost):
    """Voltage [V] that reaches the motor."""
    within = absolute(applied_voltage) < voltage
    off = select(within, applied_voltage, lost * clamp(applied_voltage, -voltage, voltage))
    return {"applied_voltage": applied_voltage - off}


EFFECT = Effect(
    name="driver_deadband",
    summary="dead band of the H-bridge",
    locations={"motors": (0, 1)},
    parameters=(
        Parameter(
            "voltage",
            "V",
            "half of the dead band",
            0.0,
            1e-5,
            24.0,
            (0.005, 0.01, 0.02, 0.03, 0.045, 0.07, 0.15, 0.5, 1.5),
            size=True,
            log=True,
        ),
        share(
            "lost",
            "share of the band that is missing at larger voltages too",
            starts=(1.0, 0.0),
            default=1.0,
        ),
    ),
    laws=(Law("motor", bridge),),
    equation=r"V = 0\ \text{where}\ |V_c| < V_d,\ \text{else}\ "
    r"V_c - \lambda\,V_d\,\mathrm{sgn}(V_c)",
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
