"""What is slow in one axis alone is no noise of the tracker."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import ASIDE, machine, pair, with_effects
from scipy.signal import lfilter

from corexy_fmi.engine import diagnose

CASES = {
    "slow in both": ({"x": 0.9, "y": 0.9}, {}, "nothing_missing"),
    "slow in y": ({"x": 0.0, "y": 0.9}, {}, "unexplained"),
    "slow in x": ({"x": 0.8, "y": 0.0}, {}, "unexplained"),
    "white, one twice as loud": ({"x": 0.0, "y": 0.0}, {"y": 2.0}, "nothing_missing"),
    "two sensors": ({"x": 0.0, "y": 0.9}, {"y": 2.0}, "nothing_missing"),
}


def with_noise(recording, colour, louder, seed):
    """White noise of 20 um and, beside it, as much slow noise of that colour."""
    random, channels = np.random.default_rng(seed), dict(recording.channels)
    for name, rho in colour.items():
        white, quick = random.normal(size=(2, len(recording)))
        slow = lfilter([np.sqrt(1 - rho**2)], [1, -rho], white) * (rho > 0)
        channels[name] = channels[name] + 2e-5 * louder.get(name, 1.0) * (quick + slow)
    return replace(recording, channels=channels)


@pytest.mark.parametrize("case", CASES)
def test_slow_noise_of_one_axis_is_doubted_where_the_sensor_is_one(case):
    colour, louder, word = CASES[case]
    train, judge = pair(with_effects(machine(), **ASIDE), noise=0.0)
    parts = ((train, 1), (judge, 2))
    files = [[with_noise(r, colour, louder, seed) for r in part] for part, seed in parts]
    document = diagnose(*files, machine(), jobs=2).document
    assert document["verdict"] == word
    if word == "unexplained":
        axis = case[-1]
        assert document["located"]["coordinate"] == axis
        assert f"the mismatch of {axis} is slow" in document["effects"][0]["description"]
