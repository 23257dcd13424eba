"""A constant force along an axis: a tilted stage, or friction that differs by direction.

    F = force                                                                            [N]

Source: Janot, Gautier, Brunot, Nonlinear Benchmark 2019 (EMPS): the offset of its friction model.
"""

from corexy_fmi.effects.api import Effect, Law, Parameter


def push(applied_force, force):
    """Force [N] along the axis, positive towards +."""
    return {"applied_force": applied_force + force}


EFFECT = Effect(
    name="constant_force",
    summary="tilt, or friction that differs by direction",
    locations={"x": (0,), "y": (1,)},
    parameters=(
        Parameter(
            "force",
            "N",
            "force along the axis, positive towards +",
            0.0,
            -30.0,
            30.0,
            (0.5, -0.5, 4.0, -4.0, 12.0, -12.0),
            size=True,
        ),
    ),
    laws=(Law("guide", push),),
    equation=r"F = F_0",
    citation="Janot, Gautier, Brunot 2019, Nonlinear Benchmark (EMPS)",
    remedy="Level the stage; free the axis of one-sided pulls such as a hose or a preloaded wiper.",
    check="Put a spirit level on the rail, or compare the effort of slow runs in both directions.",
    looks_like="the same missing force at all times, whatever the motion",
    state="constant",
)
