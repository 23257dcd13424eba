"""The loop of a fleet: parcels out, results in, each machine kept once."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from corexy_fmi.errors import InputError
from corexy_fmi.files import alone_in
from corexy_fmi.fleet.cases import Parcel, read_parcel
from corexy_fmi.fleet.store import Store
from corexy_fmi.fleet.table import Row, failed

Files = dict[str, bytes]
Task = Callable[[Parcel], tuple[Files, Row]]  # no files where it failed
Told = Callable[[Row, bool], None]  # a row, and whether it was found done


def diagnose_fleet(
    machines: Sequence[Path],
    machine: str | None,
    store: Store,
    task: Task,
    executor: Executor,
    ahead: int,
    told: Told = lambda row, found: None,
) -> list[Row]:
    """The rows of all machines in their order; what is done already is not done again.

    The table is renewed with each row, and ``told`` hears of it.  Raises InputError where a worker
    process died or the cluster went away; what was kept stays; and where another run is at work
    in the same folder.
    """
    rows: dict[str, Row] = {}
    pending: dict[Future[tuple[Files, Row]], Parcel] = {}

    def take(row: Row, found: bool) -> None:
        rows[row["machine"]] = row
        store.table([rows[name] for name in sorted(rows)])
        told(row, found)

    todo = _todo(machines, machine, store, take)
    with alone_in(store.out):
        store.table([])
        try:
            _fill(pending, todo, task, executor, ahead)
            while pending:
                for future in wait(pending, return_when=FIRST_COMPLETED).done:
                    parcel = pending[future]
                    files, row = _result(future, pending)
                    if files:
                        store.keep(parcel, files, row)
                    del pending[future]
                    take(row, False)
                _fill(pending, todo, task, executor, ahead)
        except BaseException:
            for future in pending:
                future.cancel()
            _stop_processes()
            raise
    return [rows[path.name] for path in machines]


def _todo(
    machines: Sequence[Path], machine: str | None, store: Store, take: Told
) -> Iterator[Parcel]:
    """Parcels of the machines that are not done; the others' rows are told on the way."""
    for folder in machines:
        try:
            parcel = read_parcel(folder, machine)
        except InputError as error:
            take(failed(folder.name, str(error)), False)
            continue
        row = store.done(parcel)
        if row is None:
            yield parcel
        else:
            take(row, True)


def _fill(
    pending: dict[Future[tuple[Files, Row]], Parcel],
    todo: Iterator[Parcel],
    task: Task,
    executor: Executor,
    ahead: int,
) -> None:
    """Submit until enough is in flight; no more is read than that."""
    while len(pending) < ahead and (parcel := next(todo, None)) is not None:
        try:
            pending[executor.submit(task, parcel)] = parcel
        except BrokenProcessPool as error:
            raise _died([*pending.values(), parcel]) from error


def _died(parcels: Iterable[Parcel]) -> InputError:
    """What to say where a worker process died."""
    names = ", ".join(sorted(parcel.name for parcel in parcels))
    return InputError(
        f"a worker process died with {names} under way, expected it to last (memory?); "
        "the same command goes on"
    )


def _result(
    future: Future[tuple[Files, Row]], pending: dict[Future[tuple[Files, Row]], Parcel]
) -> tuple[Files, Row]:
    """What a task gave; what it died of on a cluster is its machine's error."""
    names = ", ".join(sorted(parcel.name for parcel in pending.values()))
    try:
        return future.result()
    except BrokenProcessPool as error:
        raise _died(pending.values()) from error
    except CancelledError as error:
        raise InputError(
            f"the cluster went away with {names} under way; the same command goes on"
        ) from error
    except Exception as error:
        return {}, failed(pending[future].name, f"{type(error).__name__}: {error}")


def _stop_processes() -> None:
    """A diagnosis takes minutes: worker processes do not end theirs when all is given up."""
    for child in multiprocessing.active_children():
        child.terminate()
