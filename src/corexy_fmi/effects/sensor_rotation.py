"""The sensor's axes are turned against the stage's.

    x_m = x - a y,   y_m = y + a x                                                       [m]

Source: Schwenke et al., CIRP Annals 57(2), 2008, doi:10.1016/j.cirp.2008.09.008.
"""

from corexy_fmi.effects.api import EVERYWHERE, SENSOR, Effect, Law, Parameter


def turn(x, y, ax, ay, angle):
    """Position [m] and acceleration [m/s^2] as the sensor sees them."""
    return {
        "x": x - angle * y,
        "y": y + angle * x,
        "ax": ax - angle * ay,
        "ay": ay + angle * ax,
    }


EFFECT = Effect(
    name="sensor_rotation",
    summary="the sensor is turned against the stage",
    locations=SENSOR,
    parameters=(
        Parameter("angle", "rad", "by which it is turned", 0.0, -0.1, 0.1, (0.002,), size=True),
    ),
    laws=(Law("sensor", turn),),
    equation=r"x_m = x - a\,y,\qquad y_m = y + a\,x",
    citation="Schwenke et al. 2008, doi:10.1016/j.cirp.2008.09.008",
    remedy="Align the sensor with the stage, or turn its readings back by this angle.",
    check="Move along one axis only: the sensor also shows the other one moving.",
    looks_like="each axis leaks into the other, with opposite signs",
    state="position",
    coordinate="sensor",
    fidelities=EVERYWHERE,
)
