"""The recorder's clock runs wrong: a stamp t was taken at t (1 + ratio), t since the start.

    x_m(t) = x(t (1 + ratio))                                                            [m]

Applied where a recording is replayed; an FMU has its master's time.

Source: Mills, Computer Network Time Synchronization, 2006 (frequency error of a clock).
"""

from corexy_fmi.effects.api import EVERYWHERE, SENSOR, Effect, Law, Parameter


def drift(stamp, ratio):
    """When [s] since the start a sample was taken."""
    return {"stamp": stamp * (1 + ratio)}


EFFECT = Effect(
    name="clock_drift",
    summary="a clock that runs wrong: a stamp t was taken at t (1 + ratio)",
    locations=SENSOR,
    parameters=(
        Parameter(
            "ratio",
            "1",
            "positive where the recorder's clock is slow",
            0.0,
            -0.05,
            0.05,
            (2e-4,),
            size=True,
        ),
    ),
    laws=(Law("clock", drift),),
    equation=r"x_m(t) = x\left(t\,(1 + \rho)\right)",
    citation="Mills 2006, Computer Network Time Synchronization",
    remedy="Take the stamps from the controller's clock, or divide the recorder's by this factor.",
    check="Record two events a minute apart with both clocks and compare the intervals.",
    looks_like="late or early by a time that grows along the recording",
    state="time",
    coordinate="sensor",
    fidelities=EVERYWHERE,
)
