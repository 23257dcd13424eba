"""Compiled whitening does what `Noise.whiten` does, for every order, clock and offset."""

import numpy as np
import pytest

from corexy_fmi.engine.data.samples import Samples
from corexy_fmi.engine.fitting.noise import Noise
from corexy_fmi.engine.fitting.whitening import Filter
from corexy_fmi.kernel import whiten
from corexy_fmi.kernel.whiten import ORDER, Whitening

ROWS = 2600  # more than two blocks of whiten.c
COEFFICIENTS = {0: [], 1: [0.7], 2: [0.5, -0.2], 4: [0.4, 0.1, -0.1, 0.05], 8: [0.1] * 8}
TAKEN = {
    "every row": lambda n: n >= 0,
    "some hundred rows": lambda n: (n > 40) & (n < 940),
    "every tenth row": lambda n: n % 10 == 3,
    "bursts left out": lambda n: n % 97 > 20,
}


def samples(which):
    time = np.arange(ROWS) * 1e-3
    value = np.where(TAKEN[which](np.arange(ROWS)), np.sin(30 * time), np.nan)
    return Samples.of("x", value, time, np.ones(ROWS, dtype=bool))


def simulated(sets=3):
    """Channels of several sets, as the kernel returns them."""
    return np.random.default_rng(5).standard_normal((sets, 2, ROWS))


def both(monkeypatch, filtered, shown):
    """What is compiled, and what is not."""
    found = [np.full((len(shown), filtered.count), np.nan) for _ in range(2)]
    filtered.rows(shown[:, 1], list(found[0]))
    monkeypatch.setattr(whiten, "_library", lambda: None)
    filtered.rows(shown[:, 1], list(found[1]))
    return found


@pytest.mark.parametrize("free", [True, False])
@pytest.mark.parametrize("which", TAKEN)
@pytest.mark.parametrize("order", COEFFICIENTS)
def test_it_agrees_with_numpy(monkeypatch, order, which, free):
    noise = Noise(np.array(COEFFICIENTS[order]), 0.3, 0.8)
    compiled, slow = both(monkeypatch, Filter(noise, samples(which), free), simulated())
    assert np.isfinite(compiled).all()
    assert compiled == pytest.approx(slow, abs=1e-12)
    assert (np.abs(compiled.mean()) < 1e-12) == (free and order == 0)


def test_errors_and_rows_are_the_same_thing():
    noise, taken, shown = Noise(np.array([0.6]), 0.3, 0.4), samples("bursts left out"), simulated()
    filtered = Filter(noise, taken, True)
    found = np.empty((3, filtered.count))
    filtered.rows(shown[:, 0], list(found))
    assert filtered.white(taken.value - shown[:, 0, taken.rows]) == pytest.approx(found, abs=1e-12)


def test_a_run_that_broke_down_spoils_no_other(monkeypatch):
    shown = simulated()
    shown[1, 1, 700:] = np.inf
    compiled, slow = both(
        monkeypatch, Filter(Noise(np.zeros(0), 1.0, 1.0), samples("every row"), True), shown
    )
    assert not np.isfinite(compiled[1]).any()
    assert compiled[[0, 2]] == pytest.approx(slow[[0, 2]], abs=1e-12)


def test_what_does_not_fit_is_refused():
    taken, shown = samples("every row"), simulated()
    filtered = Filter(Noise(np.zeros(0), 1.0, 1.0), taken, False)
    for rows, white in (
        (shown[:, 1, :-1], np.empty((3, ROWS))),
        (shown[:, 1], np.empty((2, ROWS))),
        (shown[:, 1], np.empty((3, ROWS - 1))),
        (shown[:, 1, ::2], np.empty((3, ROWS // 2))),
    ):
        with pytest.raises(ValueError, match="expected"):
            filtered.rows(rows, list(white))
    with pytest.raises(ValueError, match=f"at most {ORDER}"):
        Whitening(slice(0, 9), None, np.zeros(0), np.zeros(ORDER + 1), 1.0, 1.0, None)
