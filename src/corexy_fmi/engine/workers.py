"""The threads of a diagnosis, and memory that it need not ask the system for again and again."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits

from corexy_fmi.engine.fitting.fit import Mapper
from corexy_fmi.kernel.spare import team

# of glibc's malloc.h
TRIM_THRESHOLD, MMAP_THRESHOLD, ARENA_MAX = -1, -3, -8
KEPT = 2**28  # [bytes] of freed memory that wait for the next call
APART = 2**25  # [bytes] from which on a block goes back at once, as it does by default
USED = {ARENA_MAX: 1, MMAP_THRESHOLD: APART, TRIM_THRESHOLD: KEPT}
# given back; that blocks go back at once from there on stays: glibc's own threshold grows as far,
# and once set it would never again
DEFAULT = {ARENA_MAX: 0, TRIM_THRESHOLD: 2**17}  # 0: as many as it likes


@contextmanager
def memory_kept() -> Iterator[None]:
    """Keep freed memory, one pool for all threads, where the C library is glibc.

    Each call of the kernel and each fit needs megabytes for a moment; got anew they cost a page
    fault for every 4 KiB, and those a tenth of a diagnosis.
    """
    try:
        c = ctypes.CDLL(None)
        c.gnu_get_libc_version  # noqa: B018
    except (AttributeError, OSError, TypeError):  # another C library; Windows has none to name
        yield
        return
    for option, value in USED.items():
        c.mallopt(option, value)
    try:
        yield
    finally:
        for option, value in DEFAULT.items():
            c.mallopt(option, value)
        c.malloc_trim(0)


@contextmanager
def workers(jobs: int) -> Iterator[Mapper]:
    """An executor's map; the kernel and BLAS run outside of Python's lock, one thread each.

    Threads that have no task help with the runs of one (`shared`).
    """
    with memory_kept(), threadpool_limits(1), team(max(jobs, 1)) as crew:
        yield crew.map
