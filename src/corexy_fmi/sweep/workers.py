"""Who does the tasks: this process, processes of its own, or a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any

from corexy_fmi.errors import InputError

AHEAD = 2  # tasks in flight for each worker: the next one waits there
NO_DASK = "dask is missing, expected it for --dask: pip install 'corexy_fmi[dask]'"


class Here(Executor):
    """Does each task at once, in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """A future that is done; what the task raises is raised here."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@contextmanager
def workers(jobs: int, dask: str | None = None) -> Iterator[tuple[Executor, int]]:
    """An executor, and how many tasks to keep in flight; raises InputError without its cluster."""
    if dask is not None:
        with _cluster(dask) as found:
            yield found
    elif jobs == 1:
        yield Here(), 1
    else:
        context = multiprocessing.get_context("spawn")
        pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin)
        try:
            with _no_interrupt():
                for _ in range(jobs):
                    pool.submit(os.getpid)
            yield pool, AHEAD * jobs
        finally:
            pool.shutdown(cancel_futures=True)


@contextmanager
def _no_interrupt() -> Iterator[None]:
    """Ctrl-C waits; what is started meanwhile never gets it, not even while it imports."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _cluster(address: str) -> Iterator[tuple[Executor, int]]:
    """The executor of a Dask scheduler."""
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError(NO_DASK) from error
    try:
        client = Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise InputError(f"dask: no scheduler at {address!r}, expected host:port") from error
    with client:
        cores = sum(client.ncores().values())
        if not cores:
            raise InputError(f"dask: the scheduler at {address!r} has no workers, expected some")
        yield client.get_executor(), AHEAD * cores


def _begin() -> None:
    """A worker leaves Ctrl-C to its parent, and goes with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_go_with_parent, daemon=True).start()


def _go_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
