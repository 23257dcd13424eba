"""The sensor's samples are late by a fixed time.

    x_m(t) = x(t - delay)                                                                [m]

Source: Ljung, System Identification, 1999 (dead time).
"""

from corexy_fmi.effects.api import EVERYWHERE, SENSOR, Effect, Law, Parameter


def late(lateness, delay):
    """How late [s] a sample is."""
    return {"lateness": lateness + delay}


EFFECT = Effect(
    name="sensor_delay",
    summary="samples late by a fixed time",
    locations=SENSOR,
    parameters=(
        Parameter(
            "delay",
            "s",
            "time by which every sample is late",
            0.0,
            0.0,
            0.05,
            (0.002, 0.03),
            size=True,
        ),
    ),
    laws=(Law("sampling", late),),
    equation=r"x_m(t) = x(t - T)",
    citation="Ljung 1999, System Identification",
    remedy="Correct the time stamps of the tracker, or switch its smoothing off.",
    check="Tap the carriage and film the tracker's display, or record a start beside a switch.",
    looks_like="an error proportional to speed along the path",
    state="speed",
    coordinate="sensor",
    fidelities=EVERYWHERE,
    history=0.05,
)
