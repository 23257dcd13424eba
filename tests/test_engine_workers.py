"""Threads of a diagnosis: they work in order, with any C library."""

import ctypes

import pytest

from corexy_fmi.engine import workers


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
