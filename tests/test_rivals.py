"""The rivals' own parts, on data whose answer is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.rivals.common import corrected, rms
from benchmarks.rivals.library import NOMINAL, columns, play
from benchmarks.rivals.sparse import SETTINGS, Setting, beside, criterion, sparse

RNG = np.random.default_rng(1)


def test_rms_leaves_offsets_and_blanks_out() -> None:
    left = np.array([[1.0, np.nan], [3.0, 7.0], [np.nan, 9.0]])
    assert rms([left]) == pytest.approx(1.0)
    part = SimpleNamespace(left=left)
    assert corrected([part], [np.nan_to_num(left)]) == pytest.approx(0.0, abs=1e-15)


def test_play_stays_within_its_gap_and_turns_with_the_motor() -> None:
    angle = np.concatenate([np.linspace(0, 1, 50), np.linspace(1, 0, 50)])
    lag = play(angle, 0.2)
    assert np.abs(lag).max() == pytest.approx(0.1)
    assert lag[49] == pytest.approx(-0.1)
    assert lag[-1] == pytest.approx(0.1)


def test_the_library_holds_the_laws_that_it_says() -> None:
    time = np.arange(200) * 1e-3
    moved = np.column_stack([0.01 * np.sin(20 * time), 0 * time])
    phi = np.column_stack([moved.sum(axis=1), moved[:, 0]]) / 0.005
    found = columns(phi, moved, 0.005, time, {})
    speed = np.gradient(moved[:, 0], time)
    assert found[NOMINAL, "vx"] == pytest.approx(speed)
    assert found["quadratic_drag", "vx|vx|"] == pytest.approx(speed * np.abs(speed))
    assert np.abs(found["belt_mismatch", "e1"]).max() < 1e-12  # eq. (1) holds: no belt is stretched


def test_a_term_that_gains_nothing_is_not_worth_its_place() -> None:
    one, two = np.array([[1.0, 0.0]]), np.array([[1.0, 1.0]])
    assert criterion(1e-5, 1000, one) < criterion(1e-5, 1000, two)
    assert criterion(0.99e-5, 1000, two) < criterion(1e-5, 1000, one)


@pytest.mark.parametrize("setting", SETTINGS[2:], ids=str)
def test_pysindy_finds_planted_terms(setting: Setting) -> None:
    pytest.importorskip("pysindy", reason="pysindy is not installed: pip install '.[rivals]'")
    theta = RNG.standard_normal((400, 12)) * np.logspace(-3, 3, 12)
    truth = np.zeros((1, 12))
    truth[0, [2, 9]] = 20.0, 3e-3
    lacking = theta @ truth.T
    theta = np.column_stack([theta, theta[:, 2] + theta[:, 3]])  # says nothing of its own
    found = sparse(theta, lacking + 1e-4 * RNG.standard_normal(lacking.shape), setting)
    assert set(np.flatnonzero(found[0])) >= {2, 9}
    assert theta @ found.T == pytest.approx(lacking, abs=0.05 * lacking.std())


def test_terms_that_the_nominal_ones_hide_are_found() -> None:
    pytest.importorskip("pysindy", reason="pysindy is not installed: pip install '.[rivals]'")
    own, rest = RNG.standard_normal((400, 2)), RNG.standard_normal((400, 5))
    theta = np.column_stack([own, rest + 3 * own[:, :1]])
    lacking = (theta[:, 4] - 3 * theta[:, 0])[:, None]  # retuning has taken its part of column 4
    found = beside(theta, lacking, np.arange(7) < 2, Setting(1, terms=1))
    assert found[0] == pytest.approx([-3, 0, 0, 0, 1, 0, 0], abs=0.05)


def test_no_setting_is_no_term() -> None:
    assert not sparse(np.ones((5, 3)), np.ones((5, 2)), Setting(0)).any()
