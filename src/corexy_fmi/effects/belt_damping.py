"""Material damping of the belts beyond the nominal one.

    T = k (e + (T_n + time) de/dt)                                                       [N]

Source: Lakes, Viscoelastic Materials, Cambridge University Press, 2009 (Kelvin-Voigt).
"""

from corexy_fmi.effects.api import BELTS, Effect, Law, Parameter


def damp(damping_time, time):
    """Damping of a section over its stiffness [s]."""
    return {"damping_time": damping_time + time}


EFFECT = Effect(
    name="belt_damping",
    summary="material damping far above the nominal",
    locations=BELTS,
    parameters=(
        Parameter(
            "time",
            "s",
            "damping of a section over its stiffness, beyond the nominal",
            0.0,
            0.0,
            0.01,
            (2e-4, 1e-3),
            size=True,
        ),
    ),
    laws=(Law("belt", damp),),
    equation=r"T = k \left(e + \tau\,\dot e\right)",
    citation="Lakes 2009, Viscoelastic Materials",
    remedy="Nothing is broken: put the damping into the model; a glass-cord belt has less of it.",
    check="Tap the carriage with the motors held: the ring dies out sooner than the model's.",
    looks_like="ringing that is weaker, and corners that are rounder, than predicted",
    state="speed",
    coordinate="belts",
    claims={"odd": True, "dissipative": True},
)
