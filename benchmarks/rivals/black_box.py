"""Black boxes on the residual: what the retuned model leaves, learned from features of the motion.

scikit-learn's gradient boosting and a small neural network.  They improve a prediction; they have
no cause to name.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks.rivals.common import Array, Ground, Part, corrected

LAGS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2)  # [s]
SEED = 0
NOTHING: tuple[str, Callable[[], Any]] = ("nothing", lambda: None)


def features(part: Part) -> Array:
    """Of every row: place, speed, acceleration, motors' rates now and before, and since when each
    motor goes its way (rows, features).
    """
    time, said = part.time, part.said
    rates = np.gradient(part.travel, time, axis=0)
    columns = [said[n] for n in ("x", "y", "vx", "vy", "ax", "ay")]
    columns += [np.sin(part.travel[:, m]) for m in (0, 1)]
    columns += [np.cos(part.travel[:, m]) for m in (0, 1)]
    for lag in (0.0, *LAGS):
        columns += [np.interp(time - lag, time, r) for r in rates.T]
        columns += [np.interp(time - lag, time, said[n]) for n in ("vx", "vy")]
    columns += [way for r in rates.T for way in since_turn(time, r)]
    return np.column_stack(columns)


def since_turn(time: Array, rate: Array) -> tuple[Array, Array]:
    """The last direction of a motor (rows,), and for how long it holds (rows,) [s]."""
    way, begun, last, at = np.zeros_like(rate), np.zeros_like(rate), 0.0, time[0]
    for k, r in enumerate(rate.tolist()):
        sign = float(np.sign(r))
        if sign and sign != last:
            last, at = sign, time[k]
        way[k], begun[k] = last, time[k] - at
    return way, begun


def _rows(parts: Sequence[Part], axis: int) -> tuple[Array, Array]:
    pairs = [(features(p), p.left[:, axis], p.used[:, axis]) for p in parts]
    kept = [(f[u], v[u]) for f, v, u in pairs]
    return np.concatenate([f for f, _ in kept]), np.concatenate([v for _, v in kept])


def settings() -> dict[str, list[tuple[str, Callable[[], Any]]]]:
    """What is tried of either kind, the plainest last: nothing at all."""
    from sklearn.ensemble import HistGradientBoostingRegressor
    from sklearn.neural_network import MLPRegressor
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    def boosting(rounds: int, leaves: int) -> Any:
        return HistGradientBoostingRegressor(
            max_iter=rounds, max_leaf_nodes=leaves, learning_rate=0.05, min_samples_leaf=40,
            early_stopping=False, random_state=SEED,
        )  # fmt: skip

    def network(width: int, alpha: float) -> Any:
        inner = MLPRegressor(
            hidden_layer_sizes=(width, width), alpha=alpha, early_stopping=True, random_state=SEED
        )
        return make_pipeline(StandardScaler(), inner)

    trees, nets = ((150, 15), (60, 15), (20, 4)), ((32, 1.0), (8, 10.0))
    return {
        "gradient boosting": [
            (f"{n} rounds, {m} leaves", partial(boosting, n, m)) for n, m in trees
        ]
        + [NOTHING],
        "neural network": [(f"2 x {n}, alpha {a:g}", partial(network, n, a)) for n, a in nets]
        + [NOTHING],
    }


def learned(make: Callable[[], Any], train: Sequence[Part], late: Sequence[Part]) -> list[Array]:
    """Corrections (rows, 2) [m] of the late parts."""
    changes = [np.zeros_like(p.left) for p in late]
    for axis in (0, 1):
        inputs, wanted = _rows(train, axis)
        model = make()
        if model is None:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that it stopped before it settled
            model.fit(inputs, 1e6 * wanted)
        for part, change in zip(late, changes, strict=True):
            change[:, axis] = 1e-6 * model.predict(features(part))
    return changes


def black_boxes(ground: Ground) -> dict[str, dict[str, Any]]:
    """Each kind's held-out rms [m]; its setting predicts one training recording from the other."""
    found, folds = {}, [([a], [b]) for a, b in (ground.train, ground.train[::-1])]
    for kind, tried in settings().items():
        scores = [np.mean([corrected(b, learned(m, a, b)) for a, b in folds]) for _, m in tried]
        name, make = tried[int(np.argmin(scores))]
        rms = corrected(ground.holdout, learned(make, ground.train, ground.holdout))
        found[kind] = {"rms": rms, "named": [], "terms": [], "setting": name}
    return found
