"""The driver gives no more than its supply.

    V = (1 - soft) clamp(V_c, -voltage, voltage) + soft V_c / (1 + (V_c / voltage)^8)^(1/8)  [V]

A current limit cuts sharply (soft = 0); a supply that gives way under load has a knee (soft = 1).

Source: Hippe, Windup in Control, Springer, 2006.
"""

from corexy_fmi.effects.api import DC, Effect, Law, Parameter, share
from corexy_fmi.kernel.xmath import clamp, select, sqrt

FAR = 1e3  # times the limit: beyond it the knee is the limit itself


def knee(applied_voltage, voltage):
    """The limit with a rounded corner: V / (1 + r^8)^(1/8), r = V / voltage."""
    inside = clamp(applied_voltage, -FAR * voltage, FAR * voltage)
    held = voltage + 1e-12  # 0 switches the effect off, and must not divide
    eighth = held * held * held * held * held * held * held * held
    eighth += inside * inside * inside * inside * inside * inside * inside * inside
    return inside * held / sqrt(sqrt(sqrt(eighth)))


def limit(applied_voltage, voltage, soft):
    """Voltage [V] that reaches the motor."""
    sharp = clamp(applied_voltage, -voltage, voltage)
    held = sharp + soft * (knee(applied_voltage, voltage) - sharp)
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
        share("soft", "share of a rounded knee in place of a sharp corner"),
    ),
    laws=(Law("motor", limit),),
    equation=r"V = (1 - s)\,\mathrm{clamp}(V_c, -V_m, V_m) + "
    r"s\,V_c / (1 + (V_c / V_m)^8)^{1/8}",
    citation="Hippe 2006, Windup in Control",
    remedy="Raise the supply voltage, or lower the acceleration and the loop's gains.",
    check="Record the motor's voltage in a quick start: it is flat at the top.",
    looks_like="the motors fall behind whenever much voltage is asked for",
    state="voltage",
    coordinate="motors",
    drives=(DC,),
    claims={"odd": True},
)
