"""The driver gives no more than its supply.

    V = clamp(V_c, -voltage, voltage)                                                    [V]

Source: Hippe, Windup in Control, Springer, 2006.
"""

from corexy_fmi.effects.api import DC, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import clamp, select


def limit(applied_voltage, voltage):
    """Voltage [V] that reaches the motor."""
    held = clamp(applied_voltage, -voltage, voltage)
    return {"applied_voltage": select(voltage > 0, held, applied_voltage)}


EFFECT = Effect(
    name="supply_saturation",
    summary="voltage limit of the driver",
    locations={"motors": (0, 1)},
    parameters=(
        Parameter(
            "voltage",
            "V",
            "largest voltage; 0 switches the effect off (no limit)",
            0.0,
            0.01,
            1e3,
            (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0),
            size=True,
            log=True,
            scaling=-1,
            over="threshold",
        ),
    ),
    laws=(Law("motor", limit),),
    equation=r"V = \mathrm{clamp}(V_c, -V_m, V_m)",
    citation="Hippe 2006, Windup in Control",
    remedy="Raise the supply voltage, or lower the acceleration and the loop's gains.",
    check="Record the motor's voltage in a quick start: it is flat at the top.",
    looks_like="the motors fall behind whenever much voltage is asked for",
    state="voltage",
    coordinate="motors",
    drives=(DC,),
    claims={"odd": True},
)
