"""The current follows the voltage late: inductance over resistance of the winding.

    time_constant dtau/dt = K_1 V - K_2 omega - tau                                      [N m]

Source: Krishnan, Electric Motor Drives, 2001.
"""

from corexy_fmi.effects.api import DC, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import exp, maximum, select


def current(applied_voltage, speed, back_emf, step, drawn, time_constant):
    """Voltage [V] that makes the mean torque of the lagging current over a step, so that its
    impulse is exact however short the lag; back-EMF lags with it.
    """
    lost, lag = back_emf * speed, maximum(time_constant, 1e-12)
    wanted, fade = applied_voltage - lost, exp(-step / lag)
    mean = wanted + (drawn - wanted) * (1 - fade) * lag / step
    late = select(time_constant > 0, mean + lost, applied_voltage)
    return {"applied_voltage": late, "drawn": wanted + (drawn - wanted) * fade}


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
