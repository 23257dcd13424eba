"""Cases whose cause lies between the log and the motors: controllers, drivers, clocks, files."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.shop import motions
from benchmarks.shop.case import Case, Run, driven, named, nothing, outside
from benchmarks.shop.motions import angles
from benchmarks.shop.sensors import added, jittered
from benchmarks.shop.simulator import simulate
from benchmarks.shop.stage import LIGHT_BENCH as LIGHT
from benchmarks.shop.stage import YIN2018 as YIN
from benchmarks.shop.stage import Array, Faults, Numbers
from benchmarks.shop.stage_cases import PLAYS

Played = Callable[[int, Array, Array], Array]
TOOTH = np.radians(24.0)  # 15 teeth round
QUARTER = np.radians(1.8) / 4
ON_COMMANDS = "motors motor1 motor2 sensor"  # what filters both commands may as well filter samples


def _played(numbers: Numbers, change: Played) -> Callable[[], list[Run]]:
    return lambda: driven(numbers, motions.usual(), played=change)


def _shaped(n: int, time: Array, phi: Array) -> Array:
    """Zero vibration at 30 Hz: half of it half a period later."""
    return (phi + np.column_stack([np.interp(time - 0.5 / 30, time, p) for p in phi.T])) / 2


def _second_late(n: int, time: Array, phi: Array) -> Array:
    return np.column_stack([phi[:, 0], np.interp(time - 4e-3, time, phi[:, 1])])


def _jumped(n: int, time: Array, phi: Array) -> Array:
    jump = TOOTH * np.clip((time - 5.0) / 3e-3, 0, 1) * (n == 0)
    return phi - np.column_stack([jump, 0 * jump])


def _crept(n: int, time: Array, phi: Array) -> Array:
    """Slips while motor 1 accelerates forward at more than 350 rad/s^2."""
    hard = np.gradient(np.gradient(phi[:, 0], time), time) > 350
    slip = 0.12 * np.cumsum(hard * np.diff(time, prepend=0.0))
    return phi - np.column_stack([slip, 0 * slip])


def _unramped(accel: float, *, halfway: bool) -> Callable[[], list[Run]]:
    def runs() -> list[Run]:
        pairs = motions.ramped(accel, halfway=halfway)
        played = driven(YIN, [made for _, made in pairs])
        return [Run(t, angles(xy), run.xy) for ((t, xy), _), run in zip(pairs, played, strict=True)]

    return runs


def _quarter_steps() -> list[Run]:
    """Motors that stand at whole quarter steps, told at 4 kHz."""
    runs = []
    for time, xy in motions.usual():
        logged, fine = angles(xy), np.arange(0, time[-1], 2.5e-4)
        asked = np.column_stack([np.interp(fine, time, p) for p in logged.T])
        states, _ = simulate(fine, np.round(asked / QUARTER) * QUARTER, LIGHT)
        seen = np.column_stack([np.interp(time, fine, states[:, a]) for a in (0, 1)])
        runs.append(Run(time, logged, seen))
    return runs


def _begun_late() -> list[Run]:
    """Cut at 0.45 s, in the first move."""
    found = []
    for time, logged, xy in driven(YIN, motions.usual()):
        k = int(np.searchsorted(time, 0.45))
        found.append(Run(time[k:] - time[k], logged[k:], xy[k:]))
    return found


def _thinned(faults: Faults | None = None) -> Callable[[], list[Run]]:
    """Every fifth row of what was played."""
    return lambda: [
        Run(*(part[::5] for part in run)) for run in driven(LIGHT, motions.usual(), faults)
    ]


def _scattered_stamps() -> list[Run]:
    random, found = np.random.default_rng(6), []
    for time, logged, xy in driven(LIGHT, motions.usual()):
        off = 8e-4 * random.uniform(-1, 1, len(time) - 1)
        found.append(Run(time + np.concatenate([[0.0], off]), logged, xy))
    return found


def _turned(n: int, time: Array, xy: Array) -> tuple[Array, Array]:
    return -6e-3 * xy[:, 1], 6e-3 * xy[:, 0]


CASES = (
    Case("shaper", "light_bench", "The controller shapes (ZV, 30 Hz) what was logged.",
         outside(ON_COMMANDS), _played(LIGHT, _shaped)),
    Case("motor2_late", "yin2018", "Motor 2 gets its commands 4 ms late.", outside("motor2"),
         _played(YIN, _second_late)),
    Case("tooth_jump", "yin2018", "Belt 1 jumps a tooth at 5 s of train1: 13.33 full steps.",
         outside("motor1"), _played(YIN, _jumped)),
    Case("creeping_pulley", "yin2018", "The pulley of motor 1 creeps on its shaft at each hard "
         "start.", outside("motor1"), _played(YIN, _crept)),
    Case("log_no_accel", "yin2018", "Logged is constant speed; the controller ramps at 1 m/s^2.",
         outside(ON_COMMANDS), _unramped(1.0, halfway=False)),
    Case("log_no_accel3", "yin2018", "Logged is constant speed from the middle of the ramps, "
         "3 m/s^2.", outside(ON_COMMANDS), _unramped(3.0, halfway=True)),
    Case("quarter_step", "light_bench", "The drivers stand at quarter steps.",
         outside("motors motor1 motor2"), _quarter_steps),
    Case("log100Hz", "light_bench", "Nothing; the log has a row every 10 ms.", nothing(),
         _thinned()),
    Case("log100Hz_sticks", "light_bench", "y breaks away at 1.8 times its friction; a row every "
         "10 ms.", named("y", [("stribeck_friction", "y")]),
         _thinned(Faults(breakaway=(1, 1.8), fades=0.004))),
    Case("log100Hz_play", "light_bench", "Play of 15 mrad at both motors; a row every 10 ms.",
         PLAYS,
         _thinned(Faults(play=(0.015, 0.015)))),
    Case("stamp_jitter", "light_bench", "Nothing; the log's stamps scatter by 0.8 ms.", nothing(),
         _scattered_stamps),
    Case("slow_clock_jit", "yin2018", "The sensor's clock is off by 0.04 %, its samples scatter by "
         "0.8 ms.", named("sensor", [("clock_drift", "sensor")]),
         lambda: driven(YIN, motions.usual()), sensor=jittered(-4e-4, 8e-4)),
    Case("moving_rot", "yin2018", "The sensor is turned by 6 mrad; recording begins in motion.",
         named("sensor", [("sensor_rotation", "sensor")]), _begun_late, sensor=added(_turned)),
)  # fmt: skip
