"""The loop of a sweep: tasks out, tables in, never more in flight than the workers need."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool

from corexy_fmi.errors import InputError
from corexy_fmi.sweep.chunk import Columns, run_chunk
from corexy_fmi.sweep.folder import Folder
from corexy_fmi.sweep.plan import Plan

DIED = "a worker process died, expected it to last (memory?); the same command goes on"


def sweep(
    plan: Plan,
    folder: Folder,
    done: set[int],
    executor: Executor,
    ahead: int,
    report: Callable[[int], None] = lambda sets: None,
) -> None:
    """Do the chunks that are not done; ``report`` is told the sets of each as it is kept.

    Raises InputError where a worker process died.
    """
    todo = (index for index in range(plan.chunks) if index not in done)
    pending: dict[Future[Columns], int] = {}
    try:
        _fill(plan, executor, pending, todo, ahead)
        while pending:
            for future in wait(pending, return_when=FIRST_COMPLETED).done:
                index = pending.pop(future)
                folder.keep(index, future.result())
                report(len(plan.rows(index)))
            _fill(plan, executor, pending, todo, ahead)
    except BrokenProcessPool as error:
        raise InputError(DIED) from error
    finally:
        for future in pending:
            future.cancel()


def _fill(
    plan: Plan,
    executor: Executor,
    pending: dict[Future[Columns], int],
    todo: Iterator[int],
    ahead: int,
) -> None:
    """Submit until enough is in flight."""
    while len(pending) < ahead and (index := next(todo, None)) is not None:
        pending[executor.submit(run_chunk, plan, index)] = index
