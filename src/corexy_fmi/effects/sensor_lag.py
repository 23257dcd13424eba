"""A first-order filter in the sensor.

    time_constant dx_m/dt = x - x_m                                                      [m]

Source: Ljung, System Identification, 1999 (first-order sensor dynamics).
"""

from corexy_fmi.effects.api import EVERYWHERE, SENSOR, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import exp, select


def start(x, y):
    """The filter begins at rest."""
    return {"x_slow": x, "y_slow": y, "x_last": x, "y_last": y}


def _passed(new, last, slow, step, time_constant):
    """Output of the filter after a step in which its input was a ramp; exact."""
    fade = exp(-step / time_constant)
    drop = time_constant * (new - last) / step
    return new - drop + (slow - last + drop) * fade


def follow(
    x,
    y,
    ax,
    ay,
    step,
    time_constant,
    x_slow,
    y_slow,
    x_last,
    y_last,
    ax_slow,
    ay_slow,
    ax_last,
    ay_last,
):
    """Positions [m] and accelerations [m/s^2] behind the filter."""
    return {
        "x_slow": _passed(x, x_last, x_slow, step, time_constant),
        "y_slow": _passed(y, y_last, y_slow, step, time_constant),
        "ax_slow": _passed(ax, ax_last, ax_slow, step, time_constant),
        "ay_slow": _passed(ay, ay_last, ay_slow, step, time_constant),
        "x_last": x,
        "y_last": y,
        "ax_last": ax,
        "ay_last": ay,
    }


def show(x, y, ax, ay, x_slow, y_slow, ax_slow, ay_slow, time_constant):
    """What the sensor reports."""
    on = time_constant > 0
    return {
        "x": select(on, x_slow, x),
        "y": select(on, y_slow, y),
        "ax": select(on, ax_slow, ax),
        "ay": select(on, ay_slow, ay),
    }


EFFECT = Effect(
    name="sensor_lag",
    summary="a first-order filter in the sensor",
    locations=SENSOR,
    parameters=(
        Parameter("time_constant", "s", "of the filter", 0.0, 0.0, 0.1, (0.003, 0.06), size=True),
    ),
    laws=(Law("start_sensor", start), Law("filter", follow), Law("sensor", show)),
    equation=r"T\,\dot x_m = x - x_m",
    citation="Ljung 1999, System Identification",
    remedy="Switch the sensor's filter off, raise its bandwidth, or put the filter into the model.",
    check="Start abruptly beside a faster sensor: this one rounds the start off.",
    looks_like="late in proportion to speed, and rounded where the speed changes",
    state="speed",
    coordinate="sensor",
    fidelities=EVERYWHERE,
    memory=(
        "x_slow",
        "y_slow",
        "x_last",
        "y_last",
        "ax_slow",
        "ay_slow",
        "ax_last",
        "ay_last",
    ),
)
