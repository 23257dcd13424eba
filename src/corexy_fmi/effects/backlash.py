"""Play between rotor and belt: the belt pulley is loose on its shaft by an angle.

The belt side may lag the rotor by at most gap / 2 to either side.  Inside the gap two friction
torques hold it: ``grip`` against the frame (a large one is the play operator of the textbooks) and
``hold`` against its shaft (a large one leaves no play).  Without both it floats freely.  It goes to

    argmin K (d - P / K)^2 / 2 + (grip |r phi + d - seat| + hold |d - lag|) / r,   |d| <= gap r / 2

(d: offset of the belt travel, P: net pull at d = 0, K: its stiffness, seat and lag: where the belt
side was, against the frame and against the rotor).

Source: Nordin, Gutman, Automatica 38(10), 2002, doi:10.1016/S0005-1098(02)00047-X.
"""

from corexy_fmi.effects.api import EVERYWHERE, MOTORS, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import clamp, maximum, minimum, select


def start1(travel, radius, gap, seat1):
    """The belt side of motor 1 begins somewhere in its gap."""
    lag = seat1 * gap * radius / 2
    return {"seat": travel + lag, "lag": lag}


def start2(travel, radius, gap, seat2):
    """The same of motor 2."""
    lag = seat2 * gap * radius / 2
    return {"seat": travel + lag, "lag": lag}


def seat(motor):
    """Where the belt side begins."""
    name = f"seat{motor}"
    meaning = f"where motor {motor}'s pulley begins in its gap: -1 and 1 at the contacts"
    return Parameter(name, "1", meaning, 0.0, -1.0, 1.0, (0.0,), default=0.0, initial=True)


def contact(offset, pull, pull_stiffness, travel, radius, seat, lag, gap, grip, hold):
    """Offset [m] of the belt travel against the rotor: at rest, it slips against one, or both."""
    still, half = seat - travel, gap * radius / 2
    both, less = (grip + hold) / radius, select(still <= lag, hold - grip, grip - hold) / radius
    below = minimum((pull + both) / pull_stiffness, minimum(still, lag))
    between = minimum((pull + less) / pull_stiffness, maximum(still, lag))
    above = (pull - both) / pull_stiffness
    play = clamp(maximum(below, maximum(between, above)), -half, half)
    return {"offset": offset + play, "seat": travel + play, "lag": play}


EFFECT = Effect(
    name="backlash",
    summary="play between rotor and belt",
    locations=MOTORS,
    parameters=(
        Parameter(
            "gap", "rad", "total play of the pulley on its shaft", 0.0, 0.0, 0.5, (0.02,), size=True
        ),
        Parameter(
            "grip",
            "N m",
            "friction torque against the frame that holds the loose pulley inside its gap",
            1.0,
            1e-5,
            1.0,
            (1.0, 1e-3, 1e-5),
            log=True,
            default=1.0,
        ),
        Parameter(
            "hold",
            "N m",
            "friction torque against its shaft that holds it",
            0.0,
            0.0,
            0.05,
            (0.0, 1e-3),
            default=0.0,
        ),
        seat(1),
        seat(2),
    ),
    laws=(
        Law("start", start1, places=(0,)),
        Law("start", start2, places=(1,)),
        Law("contact", contact),
    ),
    equation=(
        r"u = r\,\varphi + d,\quad |d| \leq r\,\mathrm{gap}/2,"
        r"\quad d = \arg\min \tfrac{K}{2}(d - P/K)^2"
        r" + \tfrac{\mathrm{grip}}{r}|u - u_0| + \tfrac{\mathrm{hold}}{r}|d - d_0|"
    ),
    citation="Nordin, Gutman 2002, doi:10.1016/S0005-1098(02)00047-X",
    remedy="Tighten the set screw of the motor's pulley, or clamp or glue the pulley to its shaft.",
    check="Hold the motor's shaft and turn its pulley by hand: it moves before the shaft does. "
    "Where it does not, turn the idlers of its belt: a dry one looks alike.",
    looks_like="a step of constant size in belt travel at every reversal of that motor",
    state="velocity_reversal",
    fidelities=EVERYWHERE,
    claims={"dissipative": True},
    memory=("seat", "lag"),
)
