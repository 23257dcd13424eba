"""Import of Klipper's accelerometer files: what a toolhead sensor felt during one known move.

The file holds ``#time,accel_x,accel_y,accel_z`` in s and mm/s^2 along the sensor's own axes, with
gravity in them.  The commanded angles are not in it: they follow from the move by eq. (1).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from corexy_fmi.motion import chain, line, rest
from corexy_fmi.recording.accelerometer import (
    along_stage,
    at_rest,
    commanded,
    read_samples,
)
from corexy_fmi.recording.record import Recording


@dataclass(frozen=True)
class Move:
    """One straight trapezoid move from rest to rest, in coordinates of the stage's centre.

    ``start``, ``end`` [m], ``speed`` [m/s], ``acceleration`` [m/s^2]; ``offset`` [s] is the time of
    its start after the first sample, None where nobody knows it (the clock is then left free).
    """

    start: tuple[float, float]
    end: tuple[float, float]
    speed: float
    acceleration: float
    offset: float | None = None


def import_klipper(path: str | Path, move: Move, axes: str, pulley_radius: float) -> Recording:
    """The recording of one move: phi1, phi2 [rad] commanded, ax, ay [m/s^2] without gravity.

    ``axes`` says which sensor axes are the stage's x and y, such as ``-z,+y``.  Time begins with
    the first sample or the move, whichever is earlier; rows at changes of acceleration are blank in
    ax, ay.  Raises InputError where the file or ``axes`` cannot be understood.
    """
    path = Path(path)
    stamps, felt = read_samples(path)
    measured = along_stage(felt, axes)
    lead = max(move.offset or 0.0, 0.0)
    since = stamps - stamps[0] + max(-(move.offset or 0.0), 0.0)
    straight = line(move.start, move.end, move.speed, move.acceleration)
    motion = chain(rest(move.start, lead), straight, rest(move.end, max(since[-1], 0.0)))
    end = lead + straight.duration
    measured -= at_rest(measured, (since > (end + since[-1]) / 2) & (end < since[-1]))
    return commanded(path.name, since, measured, motion, pulley_radius, _about(path, move, axes))


def _about(path: Path, move: Move, axes: str) -> dict[str, str]:
    """Where the recording comes from."""
    about = {
        "source": f"klipper {path.name}",
        "move": f"{move.start} to {move.end} m, {move.speed} m/s, {move.acceleration} m/s^2",
        "axes": axes,
    }
    return about | ({"clock": "free"} if move.offset is None else {})
