"""Noise that is slow in one axis of a tracker alone is none."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import NOISE, machine, problem, record, rich_motion
from scipy.signal import lfilter

from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.judging.axes import uneven
from corexy_fmi.kernel.layout import bundled_layout

LONG = 0.999  # of the last millisecond's
SLOW = {"white": (0.0, 0.0), "alike": (LONG, LONG), "along y": (0.0, LONG), "along x": (LONG, 0.0)}


def told(memory: tuple[float, float], every: int = 1) -> tuple[str, str]:
    """What is said of a recording whose noise remembers so much of its last row on x and y; a
    sample is taken ``every`` so many rows.
    """
    shown = record(machine(), rich_motion(), noise=0.0)
    channels = dict(shown.channels)
    for seed, (name, share) in enumerate(zip("xy", memory, strict=True)):
        quick, drive = np.random.default_rng(seed).normal(size=(2, len(shown.time)))
        slow = lfilter([np.sqrt(1 - share**2)], [1, -share], drive) if share else 0.0
        channels[name] = shown.channels[name] + NOISE * (quick + slow)
        channels[name][np.arange(len(quick)) % every > 0] = np.nan
    shown = replace(shown, channels=channels)
    base = retune(bundled_layout(), machine(), problem(shown, machine()).runs)
    return uneven(base)


@pytest.mark.parametrize("every", [1, 10], ids=["1 kHz", "100 Hz"])
@pytest.mark.parametrize("case", SLOW)
def test_only_what_one_axis_has_alone_is_told(case, every):
    axis, words = told(SLOW[case], every)
    if case in ("white", "alike"):
        assert (axis, words) == ("", "")
    else:
        assert axis == case[-1]
        assert f"the mismatch of {axis} is slow" in words
