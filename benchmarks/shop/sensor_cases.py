"""Cases whose cause lies in what measures x and y."""

from __future__ import annotations

import numpy as np

from benchmarks.shop import motions, sensors
from benchmarks.shop.case import NOTHING, Case, Run, Truth, driven, exact, nothing, outside
from benchmarks.shop.case import Sensor as Change
from benchmarks.shop.sensors import added
from benchmarks.shop.stage import LIGHT_BENCH, YIN2018, Array

SMOOTHED = outside("sensor", also=NOTHING)  # as even as noise: may pass for it


def _yin() -> list[Run]:
    return driven(YIN2018, motions.usual())


def _light() -> list[Run]:
    return driven(LIGHT_BENCH, motions.usual())


def _hum(n: int, time: Array, xy: Array) -> tuple[Array, Array]:
    return 3e-5 * np.sin(2 * np.pi * 49.97 * time + n), 0 * time


def _warming(n: int, time: Array, xy: Array) -> tuple[Array, Array]:
    warm = 1 - np.exp(-time / 6.0)
    return 6e-5 * warm, -3e-5 * warm


def _pitch(n: int, time: Array, xy: Array) -> tuple[Array, Array]:
    return 5e-5 * np.sin(2 * np.pi * xy[:, 0] / 0.02 + 0.7), 0 * time


def _of(name: str, machine: str, done: str, truth: Truth, sensor: Change) -> Case:
    return Case(name, machine, done, truth, _yin if machine == "yin2018" else _light, sensor)


CASES = (
    Case("q40_null", "light_bench", "Nothing; the encoder counts steps of 40 um.", nothing(),
         _light, log=sensors.rounded(4e-5, 7e-6), noise=0.0),
    Case("dirty_null", "light_bench", "Nothing; the log has spikes, and stands still at times.",
         nothing(), _light, log=sensors.dirty),
    Case("filtfilt_light", "light_bench", "x and y were smoothed to 15 Hz, both ways in time.",
         SMOOTHED, _light, log=sensors.low_pass(15.0, both_ways=True), noise=3e-5),
    Case("butter12", "light_bench", "The sensor smooths to 12 Hz, second order.",
         outside("sensor"), _light, log=sensors.low_pass(12.0, both_ways=False)),
    Case("camera_blur", "light_bench", "A camera at 62 Hz, exposed all the time.", SMOOTHED,
         _light, sensor=sensors.exposed(8), every=8),
    Case("hold_light", "light_bench", "Samples at 42 Hz, repeated in a log at 500 Hz.",
         outside("sensor", also=NOTHING), _light, exact, sensors.held(12)),
    _of("y_sensor_late", "yin2018", "The sensor of y is 5 ms late, that of x is not.",
        outside("sensor y"), sensors.late((5e-3,) * 3, axes=(1,))),
    _of("delay_varies", "yin2018", "Samples are late by 4, 12 and 4 ms, by recording.",
        outside("sensor"), sensors.late((4e-3, 12e-3, 4e-3))),
    _of("hum_x", "light_bench", "Mains hum of 30 um in the sensor of x.", outside("sensor x"),
        added(_hum)),
    _of("thermal_drift", "light_bench", "The sensor warms up: 60 um in x, -30 um in y, within 6 s.",
        outside("sensor xy"), added(_warming)),
    _of("scale_periodic", "yin2018", "The scale of x is off by 50 um, periodic over 20 mm.",
        outside("sensor x"), added(_pitch)),
    _of("lens", "yin2018", "The camera's lens distorts.", outside("sensor xy"),
        added(sensors.barrel)),
    _of("perspective", "yin2018", "The camera is tilted: its view tapers by 5 % a metre.",
        outside("sensor xy"), sensors.tilted(0.05)),
    _of("perspective02", "yin2018", "The camera is tilted: its view tapers by 2 % a metre.",
        outside("sensor xy"), sensors.tilted(0.02)),
    _of("loose_tool_x", "yin2018", "The tool has 80 um of play in x.", outside("sensor tool x"),
        sensors.loose_x(8e-5)),
    _of("bump", "yin2018", "Somebody bumps into the table at 5 s of train1.",
        outside("sensor frame tool x xy"), added(sensors.swayed)),
)  # fmt: skip
