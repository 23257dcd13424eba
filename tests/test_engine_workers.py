"""Threads of a diagnosis: they work in order, with any C library."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest

from corexy_fmi.engine import workers
from tests.engine_kit import machine, other_motion, problem, record, short_motion


def test_results_come_in_order():
    with workers.workers(2) as mapper:
        assert list(mapper(lambda n: n * n, range(20))) == [n * n for n in range(20)]


@pytest.mark.parametrize("error", [OSError, TypeError])
def test_without_glibc_memory_is_left_alone(monkeypatch, error):
    def none(name):
        raise error

    monkeypatch.setattr(ctypes, "CDLL", none)
    with workers.memory_kept():
        pass


def test_an_error_in_between_is_passed_on():
    with pytest.raises(ValueError, match="in between"), workers.memory_kept():
        raise ValueError("in between")


def test_threads_that_help_change_no_bit():
    one, two = (record(machine(), motion()) for motion in (short_motion, other_motion))
    first, second = (problem(r, machine(), [("backlash", "motors")]) for r in (one, two))
    both = replace(first, runs=first.runs + second.runs, noise=first.noise + second.noise)
    u = np.linspace(-0.1, 0.1, both.size)
    trials = u + np.linspace(0.0, 1e-2, 20)[:, None]
    alone = *both.linearised(u), both.residual(trials)
    with workers.workers(4):
        helped = *both.linearised(u), both.residual(trials)
    for a, b in zip(alone, helped, strict=True):
        np.testing.assert_array_equal(a, b)
