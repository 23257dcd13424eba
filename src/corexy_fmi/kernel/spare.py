"""Threads that have nothing to do help within a task: the pieces of one call, in any order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Semaphore
from typing import Any, TypeVar

Item = TypeVar("Item")


class Team:
    """So many threads at work: tasks of a map, helpers, and the caller where it shares."""

    def __init__(self, tasks: ThreadPoolExecutor, helpers: ThreadPoolExecutor, jobs: int) -> None:
        self.tasks, self.helpers, self.idle = tasks, helpers, Semaphore(jobs)

    def map(self, function: Callable[..., Any], *given: Iterable[Any]) -> Iterator[Any]:
        """As an executor's."""

        def task(*one: Any) -> Any:
            with self.idle:
                return function(*one)

        return self.tasks.map(task, *given)

    def lend(self, work: Callable[[], None]) -> Future[None] | None:
        """An idle thread's run of some work; None where all are busy."""
        if not self.idle.acquire(blocking=False):
            return None

        def helped() -> None:
            try:
                work()
            finally:
                self.idle.release()

        return self.helpers.submit(helped)


_team: ContextVar[Team | None] = ContextVar("team", default=None)
_counted: ContextVar[bool] = ContextVar("counted", default=False)  # this thread is one of `jobs`


@contextmanager
def team(jobs: int) -> Iterator[Team]:
    """So many threads; what `shared` does meanwhile in any of them may take those that idle."""

    def join() -> None:
        _team.set(made)
        _counted.set(True)

    with (
        ThreadPoolExecutor(jobs, initializer=join) as tasks,
        ThreadPoolExecutor(jobs, initializer=join) as helpers,
    ):
        made = Team(tasks, helpers, jobs)
        before = _team.set(made)
        try:
            yield made
        finally:
            _team.reset(before)


@contextmanager
def _one_of(crew: Team) -> Iterator[None]:
    """The caller as one of the team's threads, where one is idle."""
    if _counted.get() or not crew.idle.acquire(blocking=False):
        yield
        return
    before = _counted.set(True)
    try:
        yield
    finally:
        _counted.reset(before)
        crew.idle.release()


def shared(function: Callable[[Item], object], items: Sequence[Item]) -> None:
    """Call a function with each item; idle threads of the team take some.

    What the calls do must not depend on their order.  The first error is passed on.
    """
    crew = _team.get()
    if crew is None or len(items) < 2:
        for item in items:
            function(item)
        return
    with _one_of(crew):
        _among(crew, function, deque(items))


def _among(crew: Team, function: Callable[[Item], object], left: deque[Item]) -> None:
    """Each item that is left, by the caller and by whoever idles before one of its own begins."""
    helpers: list[Future[None]] = []

    def work(helped: bool = True) -> None:
        while True:
            if not helped and len(left) > 1 and (helper := crew.lend(work)):
                helpers.append(helper)
            try:
                item = left.popleft()
            except IndexError:
                return
            function(item)

    try:
        work(helped=False)
    finally:
        left.clear()
        for helper in helpers:
            helper.exception()
    for helper in helpers:
        helper.result()
