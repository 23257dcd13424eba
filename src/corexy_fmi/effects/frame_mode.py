"""Frame, motors and fixed idlers move under the reaction of what they accelerate.

    (m_f + m) u'' = -m_f w^2 u - 2 D m_f w u' - m q'',   m: moving mass of the axis      [N]

q (x, y) is relative to the frame, accelerations are absolute: q'' + u''.

Source: Rankers, Machine Dynamics in Mechatronic Systems, University of Twente, 1997.
"""

from corexy_fmi.effects.api import TWO_PI, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import maximum, select


def _restoring(step, sway, drift, surge, frequency, damping_ratio):
    """Acceleration [m/s^2] by which its own spring and damper move the frame's mass."""
    omega = TWO_PI * frequency
    pace = drift + step * surge / 2
    return -(omega**2) * (sway + step * drift / 2) - 2 * damping_ratio * omega * pace


def relative(applied_force, moving_mass, step, sway, drift, surge, mass, frequency, damping_ratio):
    """The axis seen from the frame: reduced mass [kg], and the force [N] of the frame's spring."""
    reduced = moving_mass * mass / (mass + moving_mass)
    own = _restoring(step, sway, drift, surge, frequency, damping_ratio)
    on = mass > 0
    return {
        "moving_mass": select(on, reduced, moving_mass),
        "applied_force": select(on, applied_force - reduced * own, applied_force),
    }


def sway_on(
    velocity, velocity_before, axis_mass, step, sway, drift, surge, mass, frequency, damping_ratio
):
    """The frame advances by one leap-frog step under what the axis has just done."""
    own = _restoring(step, sway, drift, surge, frequency, damping_ratio)
    share = axis_mass / mass
    now = (own - share * (velocity - velocity_before) / step) / (1 + share)
    after = drift + step * now
    return {"sway": sway + step * (drift + after) / 2, "drift": after, "surge": now}


def absolute_acceleration(acceleration, surge, mass):
    """Accelerometers feel the frame too."""
    return {"acceleration": select(mass > 0, acceleration + surge, acceleration)}


def pole(mass, frequency, damping_ratio, bridge):
    """Square [1/s^2] of the frequency of frame against axis, or of its damping rate."""
    omega, share = TWO_PI * frequency, 1 + bridge / mass
    return omega**2 * share * maximum(1, 4 * damping_ratio**2 * share)


EFFECT = Effect(
    name="frame_mode",
    summary="the frame moves under the reaction forces; x, y are relative to it",
    locations={"frame": (0, 1)},
    parameters=(
        Parameter(
            "mass",
            "kg",
            "of what moves with the frame; 0 switches the effect off (rigid)",
            0.0,
            0.2,
            1e3,
            (0.4, 2.0, 10.0),
            size=True,
            log=True,
            scaling=-1,
        ),
        Parameter(
            "frequency",
            "Hz",
            "natural frequency of the frame alone",
            20.0,
            1.0,
            200.0,
            (3.0, 5.0, 7.0, 10.0, 14.0, 19.0, 26.0, 36.0, 50.0),
            log=True,
            heard=True,
        ),
        Parameter("damping_ratio", "1", "of that mode", 0.03, 0.001, 0.3, (0.03,), log=True),
    ),
    laws=(
        Law("guide", relative),
        Law("structure", sway_on),
        Law("output", absolute_acceleration),
    ),
    equation=r"(m_f + m)\,\ddot u = -m_f \omega^2 u - 2 D m_f \omega\,\dot u - m\,\ddot q",
    citation="Rankers 1997, Machine Dynamics in Mechatronic Systems, University of Twente",
    remedy="Stiffen or bolt down the frame, add mass to it, or shape the command around its tone.",
    check="Put an accelerometer on the frame: it rings when the stage starts and stops.",
    looks_like="ringing of both axes at one low frequency after every change of acceleration",
    state="acceleration",
    coordinate="frame",
    memory=("sway", "drift", "surge"),
    pole=pole,
)
