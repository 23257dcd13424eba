"""The bridge yaws on its guides: it stands askew when its ends are pulled unequally.

    J theta'' = -K theta - C theta' + (W / 2) (F_right - F_left),   y_out = y + theta x

F: force of the belts on each end of the bridge along y; theta counter-clockwise positive.

Source: Garcia-Herreros et al., Control Engineering Practice 21(3), 2013 (dual-drive gantry stages).
"""

from corexy_fmi.effects.api import Effect, Law, Parameter
from corexy_fmi.kernel.xmath import maximum, select, sqrt


def lean(elongation, yaw_arm, spacing, step, yaw, turn, stiffness):
    """Elongation [m] of a section at an end of a bridge that stands askew."""
    longer = elongation + yaw_arm * spacing / 2 * (yaw + step * turn / 2)
    return {"elongation": select(stiffness > 0, longer, elongation)}


def swing(yaw_torque, step, yaw, turn, stiffness, inertia, damping_ratio):
    """The yaw advances by one leap-frog step, its damping taken as the mean over the step."""
    middle, rate = yaw + step * turn / 2, 2 * damping_ratio * sqrt(stiffness / inertia)
    surge = ((yaw_torque - stiffness * middle) / inertia - rate * turn) / (1 + rate * step / 2)
    after = turn + step * surge
    return {"yaw": middle + step * after / 2, "turn": after, "surge": surge}


def shown(
    position,
    velocity,
    acceleration,
    across_position,
    across_velocity,
    across_acceleration,
    yaw,
    turn,
    surge,
    stiffness,
):
    """What is reported along y of a carriage that stands off the bridge's middle."""
    on = stiffness > 0
    swung = surge * across_position + 2 * turn * across_velocity + yaw * across_acceleration
    moved = turn * across_position + yaw * across_velocity
    return {
        "position": select(on, position + yaw * across_position, position),
        "velocity": select(on, velocity + moved, velocity),
        "acceleration": select(on, acceleration + swung, acceleration),
    }


def pole(stiffness, inertia, damping_ratio, span_stiffness, spacing):
    """Square [1/s^2] of the yaw's frequency on guides and belts, or of its damping rate."""
    square = (stiffness + 4 * span_stiffness * (spacing / 2) ** 2) / inertia
    return square * maximum(1, 4 * damping_ratio**2)


EFFECT = Effect(
    name="racking",
    summary="yaw of the bridge on its guides",
    locations={"bridge": tuple(range(12))},
    parameters=(
        Parameter(
            "stiffness",
            "N m/rad",
            "of the guides against yaw; 0 switches the effect off",
            0.0,
            10.0,
            1e6,
            (100.0, 400.0, 1600.0, 6400.0),
            size=True,
            log=True,
            scaling=-1,
        ),
        Parameter(
            "inertia",
            "kg m^2",
            "of the bridge about its middle",
            1e-3,
            1e-5,
            10.0,
            (1e-3,),
            log=True,
        ),
        Parameter(
            "damping_ratio",
            "1",
            "of the yaw on its guides",
            0.05,
            1e-3,
            2.0,
            (0.05,),
            log=True,
            default=0.05,
        ),
    ),
    laws=(Law("shape", lean), Law("structure", swing, (0,)), Law("output", shown, (1,))),
    equation=r"J\ddot\theta = -K\theta - C\dot\theta + \frac{W}{2}\,(F_r - F_l),"
    r"\qquad y_{out} = y + \theta\,x",
    citation="García-Herreros et al. 2013, Control Engineering Practice 21(3)",
    remedy="Space the bridge's bearings wider, preload them, and square the bridge to the frame.",
    check="Push one end of the bridge with the motors held: the other end moves the other way.",
    looks_like="y is wrong in proportion to x while the carriage is pulled along x",
    state="position",
    coordinate="bridge",
    fidelities=("full",),
    memory=("yaw", "turn", "surge"),
    shared=True,
    pole=pole,
)
