"""Cases whose cause lies in the stage: friction, belts, play, loads."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.shop import motions
from benchmarks.shop.case import UNEXPLAINED as OPEN
from benchmarks.shop.case import Case, Run, Truth, driven, named, nothing, outside
from benchmarks.shop.motions import Motion
from benchmarks.shop.sensors import late
from benchmarks.shop.stage import LIGHT_BENCH as LIGHT
from benchmarks.shop.stage import REACH, Array, Faults, Numbers
from benchmarks.shop.stage import YIN2018 as YIN

KNOTS = np.linspace(-REACH, REACH, 241)  # [m]
FLAT = np.zeros_like(KNOTS)
PLAY1 = ("backlash", "motor1")


def _of(
    numbers: Numbers, faults: Faults | Callable[[int, Motion], Faults] | None = None,
    moves: Callable[[], list[Motion]] = motions.usual,
) -> Callable[[], list[Run]]:  # fmt: skip
    return lambda: driven(numbers, moves(), faults)


def _force(x: float, y: float) -> Callable[[int, Motion], Faults]:
    return lambda n, motion: Faults(push=np.tile([x, y], (len(motion[0]), 1)))


def _chip(n: int, motion: Motion) -> Faults:
    spot = 1.2 * np.exp(-(((KNOTS - 0.02) / 0.004) ** 2) / 2)
    return Faults(spot=np.array([spot, FLAT])) if n == 1 else Faults()


def _fan(n: int, motion: Motion) -> Faults:
    blows = 0.4 * np.sin(2 * np.pi * 23 * motion[0]) * (n == 0)
    return Faults(push=np.column_stack([0 * blows, blows]))


def _wiped(n: int, motion: Motion) -> Faults:
    x = motion[1][:, 0]
    gone = np.cumsum(np.abs(np.diff(x, prepend=x[0])))
    return Faults(grip=np.column_stack([1 + 3 * np.exp(-gone / 0.15), np.ones(len(x))]))


def _tilted_play(n: int, motion: Motion) -> Faults:
    return Faults(play=(0.012, -1.0), push=np.tile([0.0, -0.3], (len(motion[0]), 1)))


def _retensioned() -> list[Run]:
    moves = motions.usual()
    return driven(LIGHT, moves[:1]) + driven(LIGHT | {"AE": 1100.0}, moves[1:])


def _rail(table: Array) -> Array:
    return np.array([FLAT, table])


BINDING = Faults(spot=_rail(2 * np.clip(KNOTS / 0.08, 0, None)))
CHAIN = Faults(pull=_rail(-5 * (KNOTS - 0.05)), spot=_rail(np.clip(0.3 + 3 * KNOTS, 0, None)))
FRAYED = Faults(sections=(1, 1, 0.5, *[1] * 9))
DRY_LEFT = Faults(drag={3: 2.2, 5: 2.2})
GEOMETRY = YIN | {"W": 0.31, "H": 0.22, "c": 0.09, "AE": 1000.0}
CHAINED = named(
    "y", [("cable_drag", "y"), ("friction_vs_position", "y")], [("cable_drag", "y")],
    [("friction_vs_position", "y")], also=OPEN,
)  # fmt: skip
PLAYS = named(
    "motor1 motor2 motors", [("backlash", "motors")], [PLAY1, ("backlash", "motor2")]
)  # fmt: skip
LATE_PLAY = named(
    "motor2 sensor", [("backlash", "motor2"), ("sensor_delay", "sensor")]
)  # fmt: skip
OFFSET_X = named("x", [("constant_force", "x")], also="nothing_missing")
OFFSET_Y = named("y", [("constant_force", "y")], also="nothing_missing")


def _idler(name: str, number: int, factor: float, places: str, machine: str = "yin2018") -> Case:
    """An idler whose dry friction has grown."""
    numbers = YIN if machine == "yin2018" else LIGHT
    done = f"Idler {number} has {factor:g} times the dry friction."
    truth = outside(f"pulley{number} {places}")
    return Case(name, machine, done, truth, _of(numbers, Faults(dry={number: factor})))


def _yin(name: str, done: str, truth: Truth, faults: Faults) -> Case:
    return Case(name, "yin2018", done, truth, _of(YIN, faults))


def _light(
    name: str, done: str, truth: Truth, faults: Faults | Callable[[int, Motion], Faults]
) -> Case:
    return Case(name, "light_bench", done, truth, _of(LIGHT, faults))


CASES = (
    Case("null_yin", "yin2018", "Nothing.", nothing(), _of(YIN, None, motions.longer)),
    Case("null_light", "light_bench", "Nothing.", nothing(), _of(LIGHT, None, motions.longer)),
    Case("print_null_y", "yin2018", "Nothing; it moves as a printer.", nothing(),
         _of(YIN, None, motions.printing)),
    Case("geometry_off", "yin2018", "W, H, c and the belts' stiffness are not the file's.",
         nothing(), _of(GEOMETRY)),
    Case("heavy_tool", "light_bench", "The tool weighs 70 g more than the file says.", nothing(),
         _of(LIGHT | {"mx": 0.17})),
    Case("tilt_xonly", "light_bench", "The stage leans, 0.35 N along -x; only x is measured.",
         OFFSET_X, _of(LIGHT, _force(-0.35, 0.0)), columns="x"),
    _yin("coul_asym", "The rail of x grips 0.2 N forward, 0.6 N backward.", OFFSET_X,
         Faults(back={"fx": 0.6})),
    Case("oneway_asym", "light_bench", "The rail of y grips 0.55 N forward, 0.3 N backward; it "
         "only moves forward.", OFFSET_Y,
         _of(LIGHT | {"fy": 0.55}, Faults(back={"fy": 0.3}), motions.one_way)),
    _yin("visc_asym", "The wiper of x drags 60 N s/m forward, 95 backward.", outside("x"),
         Faults(back={"bx": 95.0})),
    _yin("rail_binding", "The rails of y bind towards its end: up to 2 N more friction at 80 mm.",
         named("y", [("friction_vs_position", "y")], also=OPEN), BINDING),
    Case("chip_train2", "yin2018", "A chip on the rail of x at 20 mm, in train2 only.",
         named("x", [("friction_vs_position", "x")], also=OPEN), _of(YIN, _chip)),
    Case("slow_stribeck", "light_bench", "y breaks away at 1.8 times its friction, slow motion.",
         named("y", [("stribeck_friction", "y")]),
         _of(LIGHT, Faults(breakaway=(1, 1.8), fades=0.004), motions.slow)),
    _light("dust_wiped", "Dust on the rail of x is wiped away within 0.15 m, anew in each run.",
           named("x", [("friction_warmup", "x")], also=OPEN), _wiped),
    _light("cable_chain", "A cable chain pulls along y by position, and rubs more and more.",
           CHAINED, CHAIN),
    _light("fan_train1", "A fan on the tool, 0.4 N at 23 Hz along y, in train1 only.",
           named("y", [("periodic_disturbance", "y")], also=OPEN), _fan),
    _yin("play_soft", "Play of 30 mrad at motor 1 whose ends are soft.",
         named("motor1", [PLAY1], also=OPEN), Faults(play=(0.03, -1.0), soft=0.004)),
    _light("play_tilt", "Play of 12 mrad at motor 1; the stage leans, 0.3 N along -y.",
           named("motor1", [PLAY1, ("constant_force", "y")], [PLAY1]), _tilted_play),
    Case("print_play12", "light_bench", "Play of 15 mrad at both motors; it moves as a printer.",
         PLAYS, _of(LIGHT, Faults(play=(0.015, 0.015)), motions.printing)),
    _light("play_both", "Play of 15 mrad at both motors.", PLAYS, Faults(play=(0.015, 0.015))),
    Case("play2_delay", "yin2018", "Play of 20 mrad at motor 2, and samples 5 ms late.",
         LATE_PLAY, _of(YIN, Faults(play=(-1.0, 0.02))), sensor=late((5e-3,) * 3)),
    Case("retensioned", "light_bench", "The belts were tightened after train1: 25 % stiffer.",
         outside("belts"), _retensioned),
    _yin("frayed_span", "Belt 1 is frayed between motor 1 and idler 9: half as stiff there.",
         outside("belts"), FRAYED),
    _yin("left_idlers_dry", "Idlers 3 and 5 have 2.2 times the viscous friction.",
         outside("pulley3 pulley5 x xy bridge"), DRY_LEFT),
    _idler("idler9_seized", 9, 25, "motor1"), _idler("idler9_x10", 9, 10, "motor1"),
    _idler("idler8_x20", 8, 20, "motor1"), _idler("idler10_x25", 10, 25, "motor2"),
    _idler("idler3_x20", 3, 20, "x xy"), _idler("idler9_light", 9, 8, "motor1", "light_bench"),
)  # fmt: skip
