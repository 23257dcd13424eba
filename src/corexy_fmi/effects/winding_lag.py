"""The current follows the voltage late: inductance over resistance of the winding.

    time_constant dtau/dt = K_1 V - K_2 omega - tau                                      [N m]

Source: Krishnan, Electric Motor Drives, 2001.
"""

from corexy_fmi.effects.api import DC, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import exp, maximum, select


def current(applied_voltage, speed, back_emf, step, drawn, time_constant):
    """Voltage [V] that makes the torque of the lagging current; back-EMF lags with it."""
    lost = back_emf * speed
    share = 1 - exp(-step / maximum(time_constant, 1e-12))
    now = drawn + share * (applied_voltage - lost - drawn)
    late = select(time_constant > 0, now + lost, applied_voltage)
    return {"applied_voltage": late, "drawn": now}


EFFECT = Effect(
    name="winding_lag",
    summary="inductance over resistance of the winding",
    locations={"motors": (0, 1)},
    parameters=(
        Parameter("time_constant", "s", "L / R of a winding", 0.0, 0.0, 0.05, (0.002,), size=True),
    ),
    laws=(Law("motor", current),),
    equation=r"\frac{L}{R}\,\dot\tau = K_1 V - K_2 \omega - \tau",
    citation="Krishnan 2001, Electric Motor Drives",
    remedy="Drive the motors by current, or take a winding with less inductance and more voltage.",
    check="Hold the shaft, step the voltage and watch the current: it rises by a time constant.",
    looks_like="torque that comes late, most after each change of voltage",
    state="voltage",
    coordinate="motors",
    drives=(DC,),
    memory=("drawn",),
    claims={"odd": True},
)
