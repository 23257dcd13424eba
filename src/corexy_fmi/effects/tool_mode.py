"""A compliant tool on the carriage: x, y and the accelerations are the tool's.

    m z'' = -m w^2 (z - x) - 2 D m w (z' - x'),   the carriage feels the opposite        [N]

Source: Altintas, Manufacturing Automation, 2012 (a single mode of the tool).
"""

from corexy_fmi.effects.api import Effect, Law, Parameter
from corexy_fmi.kernel.xmath import maximum, select

TWO_PI = 6.283185307179586


def start(position):
    """The tool begins at rest on the carriage."""
    return {"place": position, "pace": 0 * position}


def reaction(applied_force, position, velocity, step, place, pace, mass, frequency, damping_ratio):
    """Force [N] of the tool on the carriage; the tool's state advances by one leap-frog step.

    Its own part of the damping is the mean over the step (trapezoidal).
    """
    omega = TWO_PI * frequency
    middle, rate = place + step * pace / 2, 2 * damping_ratio * omega
    pull = omega**2 * (position - middle) + rate * (velocity - pace)
    acceleration = pull / (1 + rate * step / 2)
    after = pace + step * acceleration
    return {
        "applied_force": applied_force - mass * acceleration,
        "place": middle + step * after / 2,
        "pace": after,
        "surge": acceleration,
    }


def tip(position, velocity, acceleration, place, pace, surge, mass):
    """What is reported is the tool's; without mass there is no tool."""
    return {
        "position": select(mass > 0, place, position),
        "velocity": select(mass > 0, pace, velocity),
        "acceleration": select(mass > 0, surge, acceleration),
    }


def pole(mass, frequency, damping_ratio, carriage):
    """Square [1/s^2] of the tool's frequency against the free carriage, or of its damping rate."""
    omega, share = TWO_PI * frequency, 1 + mass / carriage
    return omega**2 * share * maximum(1, 4 * damping_ratio**2 * share)


EFFECT = Effect(
    name="tool_mode",
    summary="a compliant tool; x, y, ax, ay are the tool's",
    locations={"tool": (0, 1)},
    parameters=(
        Parameter(
            "mass",
            "kg",
            "moving mass of the tool, beside carriage_mass; 0 switches the effect off",
            0.0,
            1e-3,
            2.0,
            (0.005, 0.05),
            size=True,
            scaling=0,
            log=True,
        ),
        Parameter(
            "frequency",
            "Hz",
            "natural frequency of the tool on a carriage held fast",
            40.0,
            3.0,
            400.0,
            (8.0, 11.0, 15.0, 20.0, 27.0, 36.0, 48.0, 65.0, 90.0, 130.0),
            log=True,
            heard=True,
        ),
        Parameter(
            "damping_ratio",
            "1",
            "damping ratio of that mode",
            0.02,
            0.001,
            1.0,
            (0.05,),
            log=True,
            default=0.02,
        ),
    ),
    laws=(Law("start_axis", start), Law("guide", reaction), Law("output", tip)),
    equation=r"m \ddot z = -m \omega^2 (z - x) - 2 D m \omega (\dot z - \dot x)",
    citation="Altintas 2012, Manufacturing Automation, doi:10.1017/CBO9780511843723",
    remedy="Stiffen the tool's mount, shorten its overhang, or shape the command around its tone.",
    check="Tap the tool with the axes held: it rings at that frequency, the carriage does not.",
    looks_like="ringing at one frequency after every change of acceleration, in both axes",
    state="acceleration",
    coordinate="tool",
    memory=("place", "pace", "surge"),
    pole=pole,
)
