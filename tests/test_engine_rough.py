"""Fits over rough ground: a bowl with ripples, as dry friction makes them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import pytest
from engine_kit import DELAY, machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting.fit import Fit, minimise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.rough import (
    LONG,
    PAYS,
    across,
    averaged,
    is_rough,
    softened,
    unstuck,
)
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

RNG = np.random.default_rng(7)
SIZE, SAMPLES, RIPPLE = 8, 600, 0.1
SLOPES = RNG.standard_normal((SAMPLES, SIZE))
WAVES = RNG.standard_normal((SAMPLES, SIZE)) / 0.01  # a ripple's length is about a deviation
PHASES = RNG.uniform(0, 2 * np.pi, SAMPLES)
AWAY = 20.0 * np.ones(SIZE) / np.sqrt(SIZE * SAMPLES)  # 20 standard deviations


@dataclass(frozen=True)
class Run:
    """One recording."""

    count: int = SAMPLES


@dataclass
class Bowl:
    """Residual ``slopes u`` and noise, with sines of ``ripple`` on top."""

    ripple: float = 0.0
    size: int = SIZE
    runs: tuple[Run] = (Run(),)
    parts = (slice(0, SAMPLES),)

    def moving(self, run: int) -> np.ndarray:
        """All unknowns move the only one."""
        return np.arange(self.size)

    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Far away."""
        return np.full(self.size, -10.0), np.full(self.size, 10.0)

    def residual(self, sets: np.ndarray) -> np.ndarray:
        """Residuals (sets, samples + size), weak priors behind them."""
        bent = np.sin(sets @ WAVES.T + PHASES) - np.sin(PHASES)
        return np.hstack([sets @ SLOPES.T + self.ripple * bent, 1e-3 * sets])

    def linearised(
        self, u: np.ndarray, borrowed: None = None, stretch: float = 1.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """One-sided differences."""
        step = min(1e-4 * stretch, 0.6)
        shown = self.residual(np.vstack([u, u + step * np.eye(self.size)]))
        return shown[0], (shown[1:] - shown[0]).T / step

    def scale_unseen(self, u: np.ndarray, jacobian: np.ndarray) -> bool:
        """There is none."""
        return False

    def log_scale(self) -> float:
        """None."""
        return 0.0


def ended(ripple: float) -> Fit:
    """Where a fit by short differences ends that begins far away."""
    return minimise(cast(Problem, Bowl(ripple)), AWAY, 30)


def test_smooth_ground_is_left_alone() -> None:
    fit = ended(0.0)
    assert fit.cost < 1e-6
    assert not is_rough(fit)
    assert unstuck(fit) is fit
    assert softened(fit) is fit


@pytest.mark.parametrize(("cure", "left"), [(across, 60.0), (averaged, 0.1), (unstuck, 0.1)])
def test_a_fit_that_stopped_on_rough_ground_goes_on(cure, left) -> None:
    """Short differences end some fifteen standard deviations away from the one deep place."""
    fit = ended(RIPPLE)
    assert fit.cost > 80
    assert is_rough(fit)
    assert cure(fit).cost < left


@pytest.mark.parametrize(
    "use", [DELAY, EffectUse("sensor_lag", "sensor", {"time_constant": 0.01})], ids=["delay", "lag"]
)
def test_the_retuned_machine_is_no_dearer_than_steps_across_bends_take_it(use) -> None:
    """A late sensor pulls friction to where short steps end 20 to 50 nats above what there is."""
    shown = record(with_effects(machine(), use), rich_motion(), noise=1e-5, tracker=10)
    found = retune(bundled_layout(), machine(), problem(shown, machine()).runs)
    assert across(found).cost > found.cost - PAYS


def test_averaged_slopes_are_those_of_the_bowl() -> None:
    """Its ripples tell a single place what its surroundings do not know."""
    fit = replace(ended(RIPPLE), slopes=None)
    single, soft = fit.jacobian[:SAMPLES], softened(fit).jacobian[:SAMPLES]
    assert np.linalg.norm(single - SLOPES) > 3 * np.linalg.norm(SLOPES)
    assert np.linalg.norm(soft - SLOPES) < 0.3 * np.linalg.norm(SLOPES)


@dataclass
class Held(Bowl):
    """A bowl whose first unknown cannot move."""

    at: float = 0.0

    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Far away, but of the first."""
        low, high = super().limits()
        low[0] = high[0] = self.at
        return low, high


def test_what_is_held_keeps_the_slope_that_it_has() -> None:
    """No set moves it: a regression would find rounding, with the residual's shape."""
    fit = ended(RIPPLE)
    held = Held(RIPPLE, at=float(fit.u[0]))
    soft = softened(replace(fit, problem=cast(Problem, held), slopes=None)).jacobian
    _, known = held.linearised(fit.u, stretch=LONG)
    assert np.array_equal(soft[:, 0], known[:, 0])
    assert np.linalg.norm(soft[:SAMPLES, 1:] - SLOPES[:, 1:]) < 0.3 * np.linalg.norm(SLOPES)


def test_a_fit_that_broke_down_stays_so() -> None:
    broken = replace(ended(0.0), cost=float("inf"))
    assert unstuck(broken) is broken
    assert across(broken) is broken
    assert softened(broken) is broken


def test_the_same_twice() -> None:
    fit = ended(RIPPLE)
    assert np.array_equal(unstuck(fit).u, unstuck(fit).u)
