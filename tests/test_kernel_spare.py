"""Idle threads help within a task: each item once, never more threads than asked, the same bits."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from corexy_fmi.effects import catalogue
from corexy_fmi.kernel.call import LANES, Excitation, run_lanes
from corexy_fmi.kernel.layout import make_layout
from corexy_fmi.kernel.spare import shared, team
from corexy_fmi.machine import load_machine
from corexy_fmi.simulate import machine_vector

PATIENCE = 30.0  # [s]


class Crowd:
    """How many threads were at work at once."""

    def __init__(self) -> None:
        self.now = self.most = 0
        self.lock = threading.Lock()

    def work(self, _: object) -> None:
        with self.lock:
            self.now += 1
            self.most = max(self.most, self.now)
        time.sleep(2e-3)
        with self.lock:
            self.now -= 1


@pytest.mark.parametrize("jobs", [1, 2, 4])
def test_each_item_is_worked_on_once(jobs):
    done = []
    with team(jobs):
        shared(done.append, range(50))
    assert sorted(done) == list(range(50))


def test_without_a_team_items_come_in_order():
    done = []
    shared(done.append, range(5))
    assert done == [0, 1, 2, 3, 4]


def test_an_idle_thread_helps():
    meet = threading.Barrier(2)
    with team(2):
        shared(lambda _: meet.wait(PATIENCE), range(2))  # neither gets on alone


def test_an_idle_thread_helps_a_task_of_the_map():
    meet = threading.Barrier(2)
    with team(2) as crew:
        list(crew.map(lambda _: shared(lambda _: meet.wait(PATIENCE), range(2)), range(1)))


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_never_more_threads_work_than_asked(jobs):
    crowd = Crowd()
    with team(jobs) as crew:
        list(crew.map(lambda _: shared(crowd.work, range(6)), range(9)))
        shared(crowd.work, range(6))
    assert crowd.most == jobs


def test_an_error_of_any_item_is_passed_on():
    def fails(n: int) -> None:
        if n == 3:
            raise ValueError("of an item")

    for jobs in (1, 2):
        with team(jobs), pytest.raises(ValueError, match="of an item"):
            shared(fails, range(8))
        with team(jobs) as crew, pytest.raises(ValueError, match="of an item"):
            list(crew.map(fails, range(8)))


def test_runs_keep_their_bits_whoever_ran_them():
    layout, machine = make_layout(catalogue()), load_machine("yin2018")
    time_ = np.linspace(0.0, 0.2, 201)
    turned = 3.0 * np.sin(9.0 * time_)
    sets = np.repeat(machine_vector(machine, layout)[None], 3 * LANES + 1, axis=0)
    sets[:, 0] *= np.linspace(0.8, 1.2, len(sets))
    alone = run_lanes(layout, Excitation(time_, turned, -turned), sets)
    with team(3):
        together = run_lanes(layout, Excitation(time_, turned, -turned), sets)
    np.testing.assert_array_equal(together, alone)
    assert not np.array_equal(alone[0], alone[-1])
