"""Belt stiffness that grows with strain.

    dT/de = k (1 + coefficient s / l),  that is  T = k e (1 + coefficient s / 2 l)       [N]
    s = (1 - symmetric) e + symmetric |e|

down to the strain at which it would give nothing; below, half of the stiffness stays.  Cords that
straighten are stiffer the more the belt is strained (symmetric = 0), teeth that are pressed into
their grooves the more they bear, in either direction (1).

Source: Nayfeh, Mook, Nonlinear Oscillations, 1979 (springs with even and odd terms).
"""

from corexy_fmi.effects.api import BELTS, Effect, Law, Parameter, share
from corexy_fmi.kernel.xmath import absolute, maximum


def stiffness(section_stiffness, elongation, centre_length, coefficient, symmetric):
    """Secant stiffness [N/m] at an elongation [m]."""
    strained = (1 - symmetric) * elongation + symmetric * absolute(elongation)
    growth = 1 + coefficient * strained / (2 * centre_length)
    return {"section_stiffness": section_stiffness * maximum(growth, 0.5)}


EFFECT = Effect(
    name="belt_hardening",
    summary="belt stiffness that grows with strain",
    locations=BELTS,
    parameters=(
        Parameter(
            "coefficient",
            "1",
            "relative growth of the stiffness per unit strain",
            0.0,
            0.0,
            1000.0,
            (100.0,),
            size=True,
        ),
        share(
            "symmetric",
            "0: stiffness falls where the belt gives way, 1: it grows in either direction",
        ),
    ),
    laws=(Law("belt", stiffness),),
    equation=r"T = k\,e \left(1 + \frac{c}{2}\,\frac{(1 - s)\,e + s\,|e|}{l}\right)",
    citation="Nayfeh, Mook 1979, Nonlinear Oscillations",
    remedy="Raise the pretension so that the belts work where they are stiff, or replace them.",
    check="Hang growing weights on the carriage: each further one gives less.",
    looks_like="large loads deflect the stage otherwise than small ones, and the axes couple",
    state="load",
    coordinate="belts",
    fidelities=("full",),
)
