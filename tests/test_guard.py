"""The kernel did not become slower: ratios within one run, so that other machines agree.

`python -m benchmarks.guard` on a quiet machine renews what is stored.
"""

import time

import pytest

from benchmarks.guard import fallen, kind, measured, stored
from corexy_fmi.kernel.call import run_lanes

TRIES = 4


@pytest.fixture(scope="module")
def bar():
    """The stored ratios of this kind of processor."""
    found = stored().get(kind())
    if found is None:
        pytest.skip(f"nothing stored for {kind()}: run python -m benchmarks.guard")
    return found


def test_no_ratio_fell_by_a_third(bar):
    """Of several measurements the best, for a busy machine."""
    found = measured()
    for _ in range(TRIES - 1):
        if not fallen(found, bar):
            break
        time.sleep(0.2)
        found = {name: max(ratio, found[name]) for name, ratio in measured().items()}
    assert fallen(found, bar) == [], f"found {found}, stored {bar}: see benchmarks/guard.py"


def test_a_kernel_of_a_third_of_the_speed_is_noticed(bar):
    """The guard fails where it must: every run done three times, beside runs of the same minute."""

    def slow(*words, **options):
        for _ in range(2):
            run_lanes(*words, **options)
        return run_lanes(*words, **options)

    assert fallen(measured(slow), measured()) == list(bar)
