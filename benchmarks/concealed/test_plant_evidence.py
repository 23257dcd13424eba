"""Parts of the plant's evidence: what runs abreast, and rivals with nothing to show."""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from plant import evidence
from plant.effects import BY_NAME
from plant.evidence import Model, fit
from plant.planted import sized
from plant.world import draw_world, experiment_of


def test_how_many_runs_are_simulated_at_once_changes_no_bit(monkeypatch):
    world = draw_world(3, "rectangles", "yin2018", {"rho": 0.0}, "effect", "ten")
    model = Model(experiment_of(world))
    theta = model.still() + np.linspace(-0.3, 0.3, model.size)
    here, found = model.output(theta), []
    for threads in (1, 4):
        monkeypatch.setattr(evidence, "ABREAST", ThreadPoolExecutor(threads))
        found.append(model.jacobian(theta, here))
    assert found[0].tobytes() == found[1].tobytes()
    n, length = model.n_machine, model.lengths()[0]
    assert np.abs(found[0][:, :n]).max(axis=0).all()
    assert not found[0][length:, n : n + 2].any()  # the first run's own deflections
    assert found[0][:length, n : n + 2].any()


def test_a_fit_that_begins_where_the_model_breaks_down_is_no_better_than_any(monkeypatch):
    world = draw_world(3, "rectangles", "yin2018", {"rho": 0.0}, "effect", "ten")
    model = Model(experiment_of(world))
    truth = model.output(model.still())
    monkeypatch.setattr(model, "output", lambda theta, more=None: np.nan * truth)
    found = fit(model, truth, model.still())
    assert not found.evidence < np.inf
    assert min(5.0, found.evidence) == 5.0


@pytest.mark.parametrize("columns", [np.zeros((9, 2)), np.ones((9, 2))])
def test_a_rival_whose_signatures_vanish_or_coincide_has_no_size(columns):
    effect = BY_NAME["pulley_eccentricity"]
    shapes = ({"phase": 0.0}, {"phase": np.pi / 2})
    assert sized(effect, "pulley3", shapes, np.arange(9.0), columns) is None
    apart = columns + np.eye(9)[:, :2]
    rival = sized(effect, "pulley3", shapes, 3.0 * apart[:, 0], apart)
    assert rival.shape["phase"] == pytest.approx(0.0, abs=1e-9)
