"""What lies beyond retuning, told by products, is what projecting each change tells."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import (
    STRIBECK,
    fitted,
    machine,
    other_motion,
    problem,
    record,
    short_motion,
    with_effects,
)

from corexy_fmi.engine.naming.beyond import Beyond, beyond
from corexy_fmi.engine.naming.signature import gain_many, gain_one


@pytest.fixture(scope="module")
def fit():
    first, second = (
        problem(record(with_effects(machine(), STRIBECK), motion, noise=1e-5), machine(), std=1e-5)
        for motion in (short_motion(), other_motion())
    )
    runs, noise = (*first.runs, *second.runs), (*first.noise, *second.noise)
    return fitted(replace(first, runs=runs, noise=noise))


def drawn(fit, sets=4):
    """Changes (sets, samples) that are partly within reach."""
    behind, random = beyond(fit), np.random.default_rng(0)
    inside = random.normal(size=(sets, fit.problem.size)) @ fit.jacobian[: behind.samples].T
    outside = random.normal(size=(sets, behind.samples))
    return inside / np.linalg.norm(inside) + 1e-3 * outside / np.linalg.norm(outside)


def projected(fit, changes, part):
    """The same in the samples of one part alone, projected as they are."""
    q, _ = np.linalg.qr(fit.jacobian)
    whole = np.zeros((len(changes), len(q)))
    whole[:, part] = changes[:, part]
    return whole - (whole @ q) @ q.T


def test_products_are_those_of_projected_changes(fit):
    behind, changes = beyond(fit), drawn(fit)
    for part in (slice(0, behind.samples), *fit.problem.parts):
        products, gram = behind.of(changes[:, part], part)
        left = projected(fit, changes, part)
        assert products == pytest.approx(left @ fit.residual, rel=1e-6, abs=1e-9)
        assert gram == pytest.approx(left @ left.T, rel=1e-6, abs=1e-12)
    assert behind.off(changes)[0] == pytest.approx(
        projected(fit, changes, part=slice(None, behind.samples))[0]
    )


def test_gains_are_those_of_projected_errors(fit):
    behind, changes = beyond(fit), 30 * drawn(fit)
    q, _ = np.linalg.qr(fit.jacobian)
    white = np.repeat(fit.residual[None], len(changes), axis=0)
    white[:, : behind.samples] += changes
    left, own = white - (white @ q) @ q.T, fit.residual - q @ (q.T @ fit.residual)
    costs = 0.5 * np.einsum("ij,ij->i", left, left)
    found = behind.gains(white[:, : behind.samples])
    assert found == pytest.approx(0.5 * own @ own - costs, abs=1e-6)
    white[0, 0] = np.inf
    assert behind.gains(white[:, : behind.samples])[0] == -np.inf


def test_what_is_within_reach_has_no_gain(fit):
    """Without priors, which tell what no sample does."""
    samples = beyond(fit).samples
    q, _ = np.linalg.qr(np.vstack([fit.jacobian[:samples], np.zeros((fit.problem.size,) * 2)]))
    products, gram = Beyond(fit, q, q.T @ fit.residual).of(1e3 * fit.jacobian[:samples].T[:2])
    assert abs(gain_many(products, gram)[0]) < 1e-3
    assert gain_one(float(products[0]), float(gram[0, 0]))[0] < 1e-3


def test_gains_of_signatures_are_what_their_fit_leaves(fit):
    behind, changes = beyond(fit), drawn(fit)
    gain, factors = gain_many(*behind.of(changes))
    left = projected(fit, changes, slice(0, behind.samples))
    fitted_to = fit.residual + factors @ left
    assert gain == pytest.approx(
        0.5 * (fit.residual @ fit.residual - fitted_to @ fitted_to), rel=1e-6
    )
    products, gram = behind.of(changes)
    alone = [gain_one(float(p), float(g))[0] for p, g in zip(products, np.diag(gram), strict=True)]
    assert gain >= max(alone) * (1 - 1e-3)
