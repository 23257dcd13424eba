"""The rivals' own parts, on data whose answer is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.rivals.common import corrected, rms
from benchmarks.rivals.library import NOMINAL, columns, play
from benchmarks.rivals.sparse import SETTINGS, Setting, plainest, sparse

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


def test_the_plainest_of_equals_is_taken() -> None:
    tried = {("a", Setting(0)): 2.0, ("a", Setting(2, terms=2)): 1.005, ("b", SETTINGS[-1]): 1.0}
    assert plainest(tried) == ("a", Setting(2, terms=2))
    assert [s.rank for s in SETTINGS] == sorted(s.rank for s in SETTINGS)


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


def test_no_setting_is_no_term() -> None:
    assert not sparse(np.ones((5, 3)), np.ones((5, 2)), Setting(0)).any()
