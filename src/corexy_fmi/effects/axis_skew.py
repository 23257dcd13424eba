"""The axes are not perpendicular.

    x_m = x - a y,   y_m = y                                                             [m]

Source: Schwenke et al., CIRP Annals 57(2), 2008, doi:10.1016/j.cirp.2008.09.008 (squareness).
"""

from corexy_fmi.effects.api import EVERYWHERE, SENSOR, Effect, Law, Parameter


def skew(x, y, ax, ay, angle):
    """Position [m] and acceleration [m/s^2] as the sensor sees them."""
    return {"x": x - angle * y, "ax": ax - angle * ay}


EFFECT = Effect(
    name="axis_skew",
    summary="axes not perpendicular",
    locations=SENSOR,
    parameters=(
        Parameter(
            "angle", "rad", "deviation from a right angle", 0.0, -0.1, 0.1, (0.002,), size=True
        ),
    ),
    laws=(Law("sensor", skew),),
    equation=r"x_m = x - a\,y",
    citation="Schwenke et al. 2008, doi:10.1016/j.cirp.2008.09.008",
    remedy="Square the bridge to the frame: equalise the belt tensions and shim or re-bolt an end.",
    check="Measure both diagonals of a traced square: they differ.",
    looks_like="x is wrong in proportion to y",
    state="position",
    coordinate="sensor",
    fidelities=EVERYWHERE,
)
