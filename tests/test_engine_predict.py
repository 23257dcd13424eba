"""Predictive likelihood of a run: against its closed form for linear models."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from engine_kit import fitted, machine, problem, record, rich_motion

from corexy_fmi.engine.data.samples import make_run
from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.problem import Problem
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.judging.predict import _laplace, carried, foretell
from corexy_fmi.machine import EffectUse
from corexy_fmi.recording import Recording

RNG = np.random.default_rng(5)
SHARED, OWN, SAMPLES = 3, 2, 40


@dataclass
class Linear:
    """Residuals ``slopes u - seen``, bent by ``bend`` times the first unknown squared."""

    slopes: np.ndarray
    seen: np.ndarray
    bend: float = 0.0
    own: tuple[int, ...] = ()  # unknowns that belong to the run alone

    @property
    def unknowns(self) -> list[SimpleNamespace]:
        """Those that runs share, and those that belong to this one."""
        return [SimpleNamespace(run=0 if k in self.own else None) for k in range(SHARED)]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.slopes.shape[1]

    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """None."""
        return np.full(self.size, -np.inf), np.full(self.size, np.inf)

    def residual(self, sets: np.ndarray) -> np.ndarray:
        """Residuals of sets, rows of priors behind them."""
        white = sets @ self.slopes.T + self.bend * sets[:, :1] ** 2 - self.seen
        return np.hstack([white, np.zeros_like(sets)])

    def linearised(
        self, u: np.ndarray, borrowed: None = None, stretch: float = 1.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residual and slopes, rows of priors behind them."""
        slopes = self.slopes.copy()
        slopes[:, 0] += 2 * self.bend * u[0]
        white = self.slopes @ u + self.bend * u[0] ** 2 - self.seen
        priors = np.zeros(self.size), np.zeros((self.size, self.size))
        return np.concatenate([white, priors[0]]), np.vstack([slopes, priors[1]])


def model(bend: float = 0.0) -> tuple[Linear, np.ndarray, np.ndarray]:
    """A model, where it begins, and how sure it is of each unknown."""
    slopes = RNG.standard_normal((SAMPLES, SHARED + OWN))
    precision = np.diag([4.0, 0.5, 30.0, 1.0, 1.0])
    precision[0, 1] = precision[1, 0] = 0.8
    begin = np.r_[RNG.standard_normal(SHARED), np.zeros(OWN)]
    return Linear(slopes, RNG.standard_normal(SAMPLES), bend), begin, precision


def cost(linear: Linear, begin: np.ndarray, precision: np.ndarray) -> float:
    """By the engine."""
    return _laplace(cast(Problem, linear), begin, precision)[0]


def exact(linear: Linear, begin: np.ndarray, precision: np.ndarray) -> float:
    """Minus the log of a normal density of covariance 1 + A C A^T, its constant apart."""
    spread = np.eye(SAMPLES) + linear.slopes @ np.linalg.solve(precision, linear.slopes.T)
    missed = linear.slopes @ begin - linear.seen
    return 0.5 * float(missed @ np.linalg.solve(spread, missed) + np.linalg.slogdet(spread)[1])


def test_a_linear_model_has_the_closed_form() -> None:
    """Gaussian parameters and noise."""
    given = model()
    assert cost(*given) == pytest.approx(exact(*given), rel=1e-9)


def test_what_belongs_to_the_run_alone_is_not_paid_for() -> None:
    """As good as if its directions had never been measured."""
    linear, begin, precision = model()
    linear.own, k = (1,), 1
    precision[k] = precision[:, k] = 0.0
    precision[k, k] = 1e-9  # nothing is known of it
    across = linear.slopes[:, k] / np.linalg.norm(linear.slopes[:, k])
    slopes = np.delete(linear.slopes - np.outer(across, across @ linear.slopes), k, axis=1)
    seen = linear.seen - across * (across @ linear.seen)
    known = np.delete(np.delete(precision, k, axis=0), k, axis=1)
    apart = exact(Linear(slopes, seen), np.delete(begin, k), known)
    assert cost(linear, begin, precision) == pytest.approx(apart, abs=1e-4)


FAN = ("periodic_disturbance", "x")


def blown(phase: float, seed: int, force: float = 0.8) -> Recording:
    """A recording with a fan in it, at 7 Hz."""
    use = EffectUse(*FAN, {"amplitude": force, "frequency": 7.0, "phase": phase})
    return record(replace(machine(), effects=(use,)), rich_motion(), f"run{seed}.csv", seed=seed)


@pytest.mark.parametrize("phase", [0.9, 2.4, -2.0])
def test_a_wave_is_found_in_the_recording_kept_back_by_its_own_phase(phase: float) -> None:
    """It must be there: where it is not, the data kept back speak against it."""
    first = problem(blown(0.3, 1), machine(), [FAN])
    began = dict.fromkeys(first.keys, 0.0)
    found = {"amplitude": 0.8, "frequency": 7.0, "phase@run1.csv": 0.3}
    for unknown in first.unknowns:
        name = unknown.key.rpartition(".")[2]
        name = unknown.key.removeprefix(".".join(FAN) + ".") if "@" in unknown.key else name
        began[unknown.key] = unknown.internal(found[name]) if name in found else 0.0
    fit = minimise(first, np.array(list(began.values())), 15)
    retuned = fitted(replace(first, hypothesis=Hypothesis()))
    gains = []
    for there in (blown(phase, 2), blown(phase, 2, 0.0)):
        run = make_run(there, machine(), "holdout")
        pair = [foretell(f, run, first.noise[0]) for f in (retuned, fit)]
        gains.append(pair[0].cost - pair[1].cost)
        assert (pair[0].left > pair[1].left) == (gains[-1] > 0)
    assert gains[0] > 100
    assert gains[1] < -20
    there = carried(fit, make_run(blown(phase, 2), machine(), "holdout"), first.noise[0])
    assert np.cos(there.value(".".join(FAN) + ".phase@run2.csv") - phase) > 0.99
    assert there.value(".".join(FAN) + ".amplitude") == fit.value(".".join(FAN) + ".amplitude")


def test_cures_of_rough_ground_foretell_the_same_of_smooth(monkeypatch: pytest.MonkeyPatch) -> None:
    """They ask a posterior for all that they ask a problem for."""
    fit = fitted(problem(record(machine(), rich_motion(), "a.csv", seed=1), machine()))
    run = make_run(record(machine(), rich_motion(), "b.csv", seed=2), machine(), "holdout")
    smooth = foretell(fit, run, fit.problem.noise[0]).cost
    monkeypatch.setattr("corexy_fmi.engine.fitting.rough.is_rough", lambda fit: True)
    assert foretell(fit, run, fit.problem.noise[0]).cost == pytest.approx(smooth, abs=1.0)


def test_unknowns_of_the_run_begin_where_they_were_fitted() -> None:
    """Their prior stays at zero, wherever the search for them begins."""
    linear, begin, precision = model()
    moved = begin.copy()
    moved[SHARED:] = (0.7, -1.2)
    assert cost(linear, moved, precision) == pytest.approx(cost(linear, begin, precision), abs=0.05)


def test_what_training_left_vague_does_not_refute() -> None:
    """A wrong value by two of its standard deviations costs two nats and not hundreds."""
    linear, begin, precision = model()
    linear.slopes[:, 0] *= 100.0
    linear.seen = linear.slopes @ begin
    precision = np.diag([1.0, 1e4, 1e4, 1.0, 1.0])
    right = cost(linear, begin, precision)
    begin[0] += 2.0
    held = 0.5 * float(np.sum((linear.slopes @ begin - linear.seen) ** 2))
    assert held > 1e4
    assert cost(linear, begin, precision) - right == pytest.approx(2.0, abs=0.1)


def test_a_vague_model_pays_for_its_freedom() -> None:
    """Both meet the data; the surer one foretold it."""
    linear, begin, precision = model()
    linear.seen = linear.slopes @ begin
    vague = precision.copy()
    vague[2, 2] *= 1e-4
    assert cost(linear, begin, vague) > cost(linear, begin, precision) + 2.0


def test_bent_models_are_followed() -> None:
    """One linear step from afar would end beside the optimum."""
    linear, begin, _ = model(bend=0.3)
    target = begin.copy()
    target[0] += 1.0
    linear.seen = linear.slopes @ target + linear.bend * target[0] ** 2
    precision = np.diag([0.1, 10.0, 10.0, 1.0, 1.0])
    volume = cost(linear, target, precision)
    assert cost(linear, begin, precision) - volume < 1.0


LOST = ("missed_steps", "motor2")


def slipped(steps: float, time: float, name: str) -> Recording:
    """A recording in which a motor falls back by so many steps."""
    use = EffectUse(*LOST, {"steps": steps, "time": time})
    return record(replace(machine(), effects=(use,)), rich_motion(), name)


@pytest.mark.parametrize("steps", [1.0, -1.0, -3.0])
def test_steps_are_found_in_the_recording_kept_back_whichever_way_they_were_lost(
    steps: float,
) -> None:
    """They need not have been lost the same way there, nor as many."""
    head = ".".join(LOST)
    first = problem(slipped(1.0, 0.7, "run1.csv"), machine(), [LOST])
    known = {f"{head}.steps@run1.csv": 1.0, f"{head}.time@run1.csv": 0.7}
    began = [x.internal(known.get(x.key, float(x.value(0.0)))) for x in first.unknowns]
    fit = minimise(first, np.array(began + [0.0] * (first.size - len(began))), 15)
    run = make_run(slipped(steps, 1.3, "run2.csv"), machine(), "holdout")
    there = carried(fit, run, first.noise[0])
    assert there.value(f"{head}.steps@run2.csv") == pytest.approx(steps, abs=0.05)
    assert there.value(f"{head}.time@run2.csv") == pytest.approx(1.3, abs=0.01)
