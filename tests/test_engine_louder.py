"""What a fit leaves above the noise that is known is told, and forbids an explanation."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import NOISE, fitted, machine, problem, record, short_motion

from corexy_fmi.engine.data.samples import make_run
from corexy_fmi.engine.fitting.louder import loudest
from corexy_fmi.engine.fitting.noise import white
from corexy_fmi.engine.judging.doubt import incomplete
from corexy_fmi.engine.judging.verdict import Verdict


def fit_of(second, runs=2):
    """A fit of recordings of nothing, the second one's x made louder by an array (n,) [m]."""
    given = [record(machine(), short_motion(), f"{n}.csv", seed=n) for n in range(runs)]
    if runs > 1:
        louder = {**given[1].channels, "x": given[1]["x"] + second(len(given[1]))}
        given[1] = replace(given[1], channels=louder)
    noise = tuple((white(NOISE), white(NOISE)) for _ in given)
    whole = tuple(make_run(r, machine(), "train") for r in given)
    return fitted(replace(problem(given[0], machine()), runs=whole, noise=noise), 1)


def ringing(count):
    return 2 * NOISE * np.sin(0.9 * np.arange(count))


@pytest.mark.parametrize("runs", [1, 2])
def test_noise_alone_is_not_loud(runs):
    assert loudest(fit_of(np.zeros, runs)) is None


def test_what_is_left_in_one_recording_is_told_with_its_place():
    loud = loudest(fit_of(ringing))
    assert (loud.channel, loud.recording) == ("x", "1.csv")
    assert loud.ratio == pytest.approx(np.sqrt(1 + 2**2 / 2), rel=0.1)
    assert loud.told.startswith("what is left of x in 1.csv is 1.7 times")


def test_nothing_that_leaves_so_much_is_unexplained():
    found = incomplete(Verdict("nothing_missing", None), "it is loud")
    assert (found.word, found.reason, found.entry) == ("unexplained", "it is loud", None)
