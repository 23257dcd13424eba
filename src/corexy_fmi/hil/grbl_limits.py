"""What machine file, options and the controller's settings allow, checked before anything moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.hil.grbl_moves import Grid, Move
from corexy_fmi.hil.grbl_report import Build, Family
from corexy_fmi.hil.limits import Allowed
from corexy_fmi.machine import Machine
from corexy_fmi.motion import half_stage

Array = NDArray[np.float64]
NEEDED = (100, 101, 110, 111, 120, 121)
ALIKE = 1e-3  # relative difference of steps per mm that is still the same machine
FASTEST = 30_000  # [steps/s] of GRBL on an ATmega328P
STAYS, STAY_ON = 1, 255  # $1 that keeps the drivers on at rest
DEVIATION = 11  # $11
PULSE = 30  # [us] that a TB6560 wants: $0


def check_controller(build: Build, settings: Mapping[int, float], per_mm: float) -> None:
    """Is it a Core-XY with the machine's steps, whose drivers stay on?  InputError where not."""
    if build.corexy is False:
        raise InputError("controller: not built for Core-XY, expected option C in $I: build GRBL "
                         "with `#define COREXY`")  # fmt: skip
    absent = [f"${n}" for n in NEEDED if n not in settings]
    if absent:
        raise InputError(f"controller: does not tell {', '.join(absent)}, expected them in $$")
    for number in (100, 101):
        if abs(settings[number] / per_mm - 1) > ALIKE:
            raise InputError(
                f"controller: ${number}={settings[number]:g} steps/mm, expected {per_mm:.3f} for "
                f"this machine's pulley: set ${number}={per_mm:.3f}, or --counts"
            )
    if settings[100] != settings[101]:
        raise InputError(f"controller: $100={settings[100]:g} and $101={settings[101]:g} differ, "
                         "expected the same: x and y share both motors")  # fmt: skip
    if settings.get(STAYS, STAY_ON) != STAY_ON:
        raise InputError(f"controller: $1={settings[STAYS]:g} switches the drivers off at every "
                         f"rest and the place is lost, expected $1={STAY_ON}")  # fmt: skip


def warnings(settings: Mapping[int, float], build: Build) -> list[str]:
    """What may be meant so."""
    said = []
    if settings.get(0, PULSE) < PULSE:
        said.append(f"$0={settings[0]:g} us: a TB6560 driver wants $0={PULSE}, or it misses steps")
    if build.corexy is None:
        said.append("the firmware does not tell its kinematics: make sure that it drives a Core-XY")
    if STAYS not in settings:
        said.append("the firmware does not tell whether the drivers stay on at rest: $1, in "
                    f"FluidNC idle_ms, must be {STAY_ON}, or the place is lost")  # fmt: skip
    if DEVIATION not in settings:
        said.append("the firmware does not tell its junction deviation: 0.010 mm is assumed")
    if settings.get(20, 0) == 0:
        said.append("$20=0: the controller has no soft limits; only this program checks the stage")
    return said


def travel(settings: Mapping[int, float], build: Build) -> tuple[Array, Array]:
    """Least and largest machine position (2,) [mm] after homing, by $130, $131, $23.

    GRBL counts down from 0 at its switches; built with homing at the origin (option Z), it counts
    up from an axis that homes to its negative end.
    """
    size = np.array([settings.get(130, np.nan), settings.get(131, np.nan)])
    mask = int(settings.get(23, 0))
    upward = np.array([bool(mask & 1), bool(mask & 2)]) & ("Z" in build.options)
    return np.where(upward, 0.0, -size), np.where(upward, size, 0.0)


def check_moves(
    start: tuple[int, int], made: Sequence[Move], grid: Grid, settings: Mapping[int, float],
    build: Build, allowed: Allowed, machine: Machine,
) -> None:  # fmt: skip
    """Every move against the stage, speeds and travel; raises InputError with time and remedy."""
    places = np.array([start, *(move[1:] for move in made)], dtype=float)
    seconds = np.array([move.seconds for move in made])
    begins = np.concatenate([[0.0], np.cumsum(seconds)[:-1]])
    steps = np.diff(places, axis=0)
    belts = np.abs(np.column_stack([steps.sum(axis=1), steps[:, 0] - steps[:, 1]]))
    _check_accelerations(settings, allowed)
    rate = belts / seconds[:, None]
    fastest = 1e3 * allowed.speed * grid.per_mm
    _refuse(begins, rate.max(axis=1) > fastest, rate.max(axis=1) / grid.per_mm / 1e3,
            f"m/s of a belt, expected at most {allowed.speed:g} (--max-speed)")  # fmt: skip
    for m in (0, 1):
        most = settings[110 + m]
        speed = 60 * rate[:, m] / grid.per_mm
        _refuse(begins, speed > most, speed, f"mm/min of motor {m + 1}, expected at most "
                                             f"${110 + m}={most:g}")  # fmt: skip
    if build.family is Family.GRBL:
        _refuse(begins, rate.max(axis=1) > FASTEST, rate.max(axis=1),
                f"steps/s, expected at most {FASTEST} on this board")  # fmt: skip
    _check_places(begins, places[1:], grid, settings, build, machine)


def _check_accelerations(settings: Mapping[int, float], allowed: Allowed) -> None:
    for number in (120, 121):
        if settings[number] / 1e3 > allowed.acceleration:
            raise InputError(f"controller: ${number}={settings[number]:g} mm/s^2, expected at most "
                             f"{1e3 * allowed.acceleration:g} (--max-accel)")  # fmt: skip


def _check_places(
    begins: Array, places: Array, grid: Grid, settings: Mapping[int, float], build: Build,
    machine: Machine,
) -> None:  # fmt: skip
    stage = np.abs(grid.metres(places))
    outside = (stage > np.array(half_stage(machine)) + 1e-3 / grid.per_mm).any(axis=1)
    _refuse(begins, outside, stage.max(axis=1), "m from the centre leaves the stage of the machine "
                                                "file")  # fmt: skip
    if settings.get(20):
        low, high = travel(settings, build)
        machine_mm = places / grid.per_mm
        slack = 0.5 / grid.per_mm
        beyond = ((machine_mm < low - slack) | (machine_mm > high + slack)).any(axis=1)
        worst = np.where(machine_mm < low - slack, machine_mm, np.where(
            machine_mm > high + slack, machine_mm, 0.0))  # fmt: skip
        _refuse(begins, beyond, worst[range(len(worst)), np.abs(worst).argmax(axis=1)],
                "mm is beyond the controller's travel ($130, $131)")  # fmt: skip


def _refuse(begins: Array, bad: ArrayLike, found: Array, words: str) -> None:
    if np.any(bad):
        k = int(np.argmax(bad))
        raise InputError(f"motion at {begins[k]:.3f} s: {found[k]:.4g} {words}")
