"""What the engine's tests share: short recordings of machines with a planted effect and noise."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.samples import make_run
from corexy_fmi.engine.diagnose import Diagnosis
from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.fitting.noise import Noise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse, Machine, load_machine
from corexy_fmi.motion import Motion, chain, circle, command, line, rest
from corexy_fmi.recording import Recording
from corexy_fmi.simulate import simulate

NOISE = 2e-5  # [m] of x and y
CORNERS = (
    (0, 0), (0.03, 0), (0.03, 0.02), (0, 0.02), (-0.02, 0), (0.01, -0.02), (0, 0),
)  # fmt: skip
SPEEDS = (0.08, 0.05, 0.1, 0.06, 0.03, 0.12)  # [m/s]
STRIBECK = EffectUse("stribeck_friction", "x", {"static_ratio": 2.5, "speed": 0.01})
BACKLASH = EffectUse("backlash", "motor1", {"gap": 0.02})
MISMATCH = EffectUse("belt_mismatch", "belts", {"ratio": 0.15})
DELAY = EffectUse("sensor_delay", "sensor", {"delay": 0.004})
ASIDE = {"carriage_mass": 1.1, "belt_axial_stiffness": 0.9, "carriage_viscous_friction": 1.15}
RUN_OUT = EffectUse("pulley_eccentricity", "pulley3", {"amplitude": 1e-5, "phase": 0.5})
CASES = {
    "stribeck": ((STRIBECK,), "yin2018", {}),
    "backlash, a slow tracker": ((BACKLASH,), "yin2018", {"tracker": 10}),
    "mismatch": ((MISMATCH,), "yin2018", {}),
    "delay": ((DELAY,), "yin2018", {}),
    "backlash, dc": ((BACKLASH,), "yin2018_dc", {}),
    "nothing": ((), "yin2018", {}),
    "nothing, dc": ((), "yin2018_dc", {}),
    "run-out, weak": ((RUN_OUT,), "yin2018", {"noise": 3e-5}),
}


@cache
def machine(name: str = "yin2018", **changes: str) -> Machine:
    """A bundled machine, some of its fields changed."""
    return replace(load_machine(name), **changes)


def with_effects(chosen: Machine, *uses: EffectUse, **nominal: float) -> Machine:
    """The truth behind a recording: effects added, nominal parameters changed by factors."""
    numbers = {n: v * nominal.get(n, 1.0) for n, v in chosen.parameters.items()}
    return replace(chosen, parameters=numbers, effects=uses)


def rich_motion() -> Motion:
    """Straight moves at six speeds and two circles, 5.7 s."""
    legs = zip(CORNERS, CORNERS[1:], SPEEDS, strict=False)
    moves = [line(a, b, speed, 2.0) for a, b, speed in legs]
    return chain(
        rest((0, 0), 0.1), *moves, circle(0.01, 0.06, 2, 2.0, (-0.01, 0)), rest((0, 0), 0.3)
    )


def other_motion() -> Motion:
    """Another path at other speeds, 2.8 s."""
    corners = ((0, 0), (-0.02, -0.015), (0.025, -0.01), (0, 0))
    legs = zip(corners, corners[1:], (0.07, 0.11, 0.05), strict=False)
    moves = [line(a, b, speed, 2.0) for a, b, speed in legs]
    ring = circle(0.012, 0.08, 1, 2.0, (-0.012, 0))
    return chain(rest((0, 0), 0.1), *moves, ring, rest((0, 0), 0.2))


def short_motion() -> Motion:
    """Out and back along both axes, 1.2 s."""
    corners = ((0, 0), (0.02, 0), (0.02, 0.015), (0, 0))
    moves = [line(a, b, 0.08, 2.0) for a, b in pairwise(corners)]
    return chain(rest((0, 0), 0.05), *moves, rest((0, 0), 0.2))


def record(
    truth: Machine,
    motion: Motion,
    name: str = "train.csv",
    *,
    seed: int = 1,
    noise: float = NOISE,
    tracker: int = 0,
    channels: Iterable[str] = ("x", "y"),
) -> Recording:
    """A recording at 1 kHz; a ``tracker`` samples every so many rows only."""
    order = command(motion, truth.parameters["pulley_radius"], name=name)
    loop = truth.controller
    if loop:
        order = replace(order, metadata={"controller": f"pd kp={loop.kp!r} kd={loop.kd!r}"})
    response, random = simulate(truth, order), np.random.default_rng(seed)
    measured = {n: response[n] + noise * random.normal(size=len(response)) for n in channels}
    if tracker:
        blank = np.arange(len(order)) % tracker != 0
        measured = {n: np.where(blank, np.nan, v) for n, v in measured.items()}
    volts = {n: response[n] for n in ("V1", "V2") if loop}
    return replace(order, channels={**order.channels, **volts, **measured})


def pair(truth: Machine, **options: object) -> tuple[list[Recording], list[Recording]]:
    """A training and a held-out recording of one truth."""
    train = record(truth, rich_motion(), "train.csv", seed=1, **options)
    judge = record(truth, other_motion(), "judge.csv", seed=2, **options)
    return [train], [judge]


def problem(
    recording: Recording,
    nominal: Machine,
    uses: Iterable[tuple[str, str]] = (),
    std: float = NOISE,
    **options: object,
) -> Problem:
    """The output-error problem of one recording under white noise."""
    layout, run = bundled_layout(), make_run(recording, nominal, "train")
    white = tuple(Noise(np.zeros(0), std, std) for _ in run.samples)
    hypothesis = Hypothesis(tuple(layout.find(*use) for use in uses))
    return Problem(layout, nominal, (run,), hypothesis, noise=(white,), **options)


def fitted(chosen: Problem, iterations: int = 15) -> Fit:
    """A fit from where the machine file stands."""
    return minimise(chosen, np.zeros(chosen.size), iterations)


def named(document: dict) -> set[tuple[str, str]]:
    """(name, location) of the effects of a document."""
    return {(e["name"], e["location"]) for e in document["effects"]}


def diagnosed(case: str, jobs: int = 2, without: frozenset[str] = frozenset()) -> Diagnosis:
    """A case on data whose machine lies beside its file."""
    return _diagnosed(case, jobs, without)


@cache
def _diagnosed(case: str, jobs: int, without: frozenset[str]) -> Diagnosis:
    uses, name, options = CASES[case]
    train, judge = pair(with_effects(machine(name), *uses, **ASIDE), **options)
    return diagnose(train, judge, machine(name), jobs=jobs, without=without)
