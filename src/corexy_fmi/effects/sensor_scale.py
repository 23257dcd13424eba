"""A gain error of the sensor's axes.

    x_m = scale_x x,   y_m = scale_y y                                                   [m]

Source: Schwenke et al., CIRP Annals 57(2), 2008, doi:10.1016/j.cirp.2008.09.008.
"""

from corexy_fmi.effects.api import EVERYWHERE, SENSOR, Effect, Law, Parameter


def scale(x, y, ax, ay, scale_x, scale_y):
    """Position [m] and acceleration [m/s^2] as the sensor sees them."""
    return {"x": scale_x * x, "y": scale_y * y, "ax": scale_x * ax, "ay": scale_y * ay}


EFFECT = Effect(
    name="sensor_scale",
    summary="a gain error of the sensor's axes",
    locations=SENSOR,
    parameters=(
        Parameter(
            "scale_x",
            "1",
            "reading over truth along x (1: exact)",
            1.0,
            0.8,
            1.25,
            (1.005,),
            size=True,
        ),
        Parameter(
            "scale_y",
            "1",
            "reading over truth along y (1: exact)",
            1.0,
            0.8,
            1.25,
            (1.005, 0.995),
            size=True,
        ),
    ),
    laws=(Law("sensor", scale),),
    equation=r"x_m = s_x\,x,\qquad y_m = s_y\,y",
    citation="Schwenke et al. 2008, doi:10.1016/j.cirp.2008.09.008",
    remedy="Calibrate the sensor against a gauge block, or divide its readings by these factors.",
    check="Move by a known distance (a gauge block) and read the sensor.",
    looks_like="an error in proportion to the distance from the centre",
    state="position",
    coordinate="sensor",
    fidelities=EVERYWHERE,
)
