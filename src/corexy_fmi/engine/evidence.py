"""What a diagnosis shows beside its numbers: curves and findings for the report to draw.

``diagnosis.json`` (CONTRACT 4) holds the answer; ``Evidence`` holds what the answer was read from.
The engine fills it, the report draws it and computes nothing.  Every part may be left empty.
Arrays of one record have the same length; NaN marks a sample that was not taken.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Trace:
    """One recording beside the three models, each on the rows of the recording.

    The maps go from a channel of CONTRACT 2 (``x``, ``vy``, ``ax``, ``phi1_meas``, ``i1``, ..) to
    (n,) values in that channel's SI unit.  The models' hold the constant offset of the channel, as
    their replay found it: none where its zero is known.
    """

    recording: str  # file name as in diagnosis.json
    role: str  # "train" or "holdout"
    time: Array  # (n,) [s], strictly increasing
    measured: Mapping[str, Array]  # (n,) each, NaN where the channel took no sample
    nominal: Mapping[str, Array]  # (n,) each: the machine file as given
    retuned: Mapping[str, Array]  # (n,) each: nominal parameters refitted
    explained: Mapping[str, Array]  # (n,) each: with the named effects
    x_ref: Array  # (n,) [m], commanded path, eq. (1) of the commanded angles
    y_ref: Array  # (n,) [m]


@dataclass(frozen=True, eq=False)
class MissingForce:
    """The force or torque that the retuned model lacks in one coordinate of one recording."""

    coordinate: str  # a location of CONTRACT 5
    recording: str
    time: Array  # (n,) [s]
    force: Array  # (n,) [unit]
    band95: Array | float  # (n,) or one number [unit]: noise alone stays within +-band95 for 95 %
    unit: str  # "N" or "N m"


@dataclass(frozen=True, eq=False)
class Law:
    """Missing force, or friction, of one coordinate against the variable that it depends on."""

    coordinate: str
    argument: str  # "vx", "vy", "x", "y", "phi1", "phi2" or "t"
    argument_unit: str
    force_unit: str
    grid: Array  # (m,) [argument_unit], increasing
    value: Array  # (m,) [force_unit]
    lower: Array  # (m,) [force_unit], 95 % band
    upper: Array  # (m,) [force_unit]
    source: str  # "free_form" (read off the data) or "effect" (what the named effect says)
    acts: str = "force"  # or "friction": Coulomb friction beside that of the axis


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Amplitude spectral densities of one channel's mismatch, pooled over recordings."""

    channel: str
    frequency: Array  # (m,) [Hz], increasing
    retuned: Array  # (m,) [channel unit / sqrt(Hz)]
    explained: Array  # (m,) same unit
    noise: Array  # (m,) same unit


@dataclass(frozen=True)
class RunnerUp:
    """One hypothesis of the competition, the winner included, best first."""

    name: str  # an effect, "free_form", or "retuned_parameters"
    location: str
    probability: float  # 0 .. 1
    gain: float  # [nats] of log evidence over the retuned machine
    heldout_rms: float | None = None  # as heldout.rms_* of diagnosis.json
    note: str = ""  # in words: why it lost, or what it needs


@dataclass(frozen=True)
class CornerSize:
    """Distance [mm] by which the explained model's path misses a corner, with and without effect.

    Both come from the same fit; ``without`` has the named effects at their neutral values.
    """

    with_effect_mm: float
    without_effect_mm: float
    recording: str


@dataclass(frozen=True)
class Finding:
    """One thing that the preflight found (units, axes, motors, channels), with its fix."""

    text: str
    fix: str = ""


@dataclass(frozen=True, eq=False)
class Evidence:
    """Everything that the report may draw; each part may be empty."""

    traces: tuple[Trace, ...] = ()
    missing_forces: tuple[MissingForce, ...] = ()
    laws: tuple[Law, ...] = ()
    spectra: tuple[Spectrum, ...] = ()
    runners_up: tuple[RunnerUp, ...] = ()
    corner: CornerSize | None = None
    preflight: tuple[Finding, ...] = ()
    leftover: tuple[float, float] | None = None  # gain [nats], standard score (specification.py)
    machine_name: str = ""
    topology: str = "corexy"  # the stage's drawing is shown for "corexy" only
    surrogate: str = ""  # one sentence where the machine is a stand-in, else empty
