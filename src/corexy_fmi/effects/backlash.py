"""Play between rotor and belt: the belt pulley is loose on its shaft by an angle.

The belt side may lag the rotor by at most gap / 2 to either side; inside the gap it moves only
where the net belt force overcomes the friction torque ``grip`` that holds it (a large grip is the
play operator of the textbooks, zero grip a freely floating pulley):

    |P - K d| <= grip / r,   |d| <= gap r / 2        (d: offset of the belt travel, P: net pull)

Source: Nordin, Gutman, Automatica 38(10), 2002, doi:10.1016/S0005-1098(02)00047-X.
"""

from corexy_fmi.effects.api import EVERYWHERE, MOTORS, Effect, Law, Parameter
from corexy_fmi.kernel.xmath import clamp


def start(travel):
    """The belt side begins in the middle of its gap."""
    return {"seat": travel}


def contact(offset, pull, pull_stiffness, travel, radius, seat, gap, grip):
    """Offset [m] of the belt travel against the rotor."""
    hold, half = grip / radius, gap * radius / 2
    lagging = seat - travel
    resting = clamp(lagging, (pull - hold) / pull_stiffness, (pull + hold) / pull_stiffness)
    play = clamp(resting, -half, half)
    return {"offset": offset + play, "seat": travel + play}


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
            "friction torque that holds the loose pulley inside its gap",
            1.0,
            1e-5,
            1.0,
            (1.0, 1e-3),
            log=True,
            default=1.0,
        ),
    ),
    laws=(Law("start", start), Law("contact", contact)),
    equation=(
        r"u = r\,\varphi + d,\quad |d| \leq r\,\mathrm{gap}/2,"
        r"\quad |P - K d| \leq \mathrm{grip}/r"
    ),
    citation="Nordin, Gutman 2002, doi:10.1016/S0005-1098(02)00047-X",
    remedy="Tighten the set screw of the motor's pulley, or clamp or glue the pulley to its shaft.",
    check="Hold the motor's shaft and turn its pulley by hand: it moves before the shaft does.",
    looks_like="a step of constant size in belt travel at every reversal of that motor",
    state="velocity_reversal",
    fidelities=EVERYWHERE,
    claims={"dissipative": True},
    memory=("seat",),
)
