"""The compiled whitening of errors: `whiten.c`, built once and cached."""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Sequence
from functools import cache

import numpy as np

from corexy_fmi.kernel.call import Array, address
from corexy_fmi.kernel.compiler import (
    FLAGS,
    SUFFIX,
    NoCompilerError,
    cache_folder,
    compile_library,
    cpu_name,
    native_flags,
    native_sources,
)

ORDER = 8  # the longest filter, `ORDER` of whiten.c


class _Whitening(ctypes.Structure):
    """`whitening` of whiten.c."""

    _fields_ = (
        *((n, ctypes.c_int64) for n in ("count", "order", "starts", "first")),
        *((n, ctypes.c_void_p) for n in ("index", "value", "start", "coefficient")),
        *((n, ctypes.c_double) for n in ("innovation", "marginal")),
        ("offset", ctypes.c_void_p),
    )


@cache
def _library() -> ctypes.CDLL | None:
    """The library; None where there is neither a cached one nor a compiler."""
    source = native_sources() / "whiten.c"
    parts = (source.read_text(encoding="utf-8"), cpu_name(), *FLAGS, *native_flags(1))
    name = hashlib.sha256("\0".join(parts).encode()).hexdigest()[:20]
    target = cache_folder() / f"whiten-{name}{SUFFIX}"
    try:
        if not target.exists():
            compile_library([source], target, *native_flags(1))
    except NoCompilerError:
        return None
    library = ctypes.CDLL(str(target))
    library.whiten.argtypes = [
        ctypes.POINTER(_Whitening), ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p
    ]  # fmt: skip
    library.whiten.restype = None
    return library


def _held(array: np.ndarray | Array | None, kind: type = np.float64) -> np.ndarray | None:
    """An array of a kind, side by side in memory; None of nothing."""
    return None if array is None or not len(array) else np.ascontiguousarray(array, dtype=kind)


class Whitening:
    """One channel's filter, ready to be called.

    ``rows``: which rows of a simulation its samples are (a slice or (m,)); ``value`` (m,): what
    was measured, None where rows are errors already; ``starts``: samples at which the filter
    begins anew; ``coefficients`` (p,), ``innovation`` and ``marginal`` as of
    `engine.fitting.noise.Noise`; ``offset`` (m,): of unit length, projected out, or None.
    """

    def __init__(
        self,
        rows: np.ndarray | slice,
        value: Array | None,
        starts: np.ndarray,
        coefficients: Array,
        innovation: float,
        marginal: float,
        offset: Array | None,
    ) -> None:
        """Keep what the pointers lead to.  Raises ValueError for a filter that is too long."""
        if len(coefficients) > ORDER:
            raise ValueError(f"a filter of order {len(coefficients)}, expected at most {ORDER}")
        if isinstance(rows, slice):
            first, self.reach, index = rows.start, rows.stop, None
            self.count = self.reach - first
        else:
            self.count, self.reach, first = len(rows), int(rows.max(initial=-1)) + 1, 0
            index = _held(rows, np.int64)
        arrays = (index, _held(value), _held(starts, np.int64), _held(coefficients), _held(offset))
        *places, last = (None if a is None else address(a) for a in arrays)
        self._kept = arrays
        sizes = self.count, len(coefficients), len(starts), first
        self._call = _Whitening(*sizes, *places, innovation, marginal, last)

    def into(self, simulated: Array, white: Sequence[Array]) -> bool:
        """Whiten rows (sets, n) into arrays (m,), one for each; False where nothing is compiled.

        Raises ValueError where shapes do not fit.
        """
        library = _library()
        if library is None:
            return False
        sets, length = simulated.shape
        if simulated.strides[1] != 8 or length < self.reach or len(white) != sets:
            wanted = f"({len(white)}, {self.reach} or more), each side by side"
            raise ValueError(f"rows {simulated.shape}, expected {wanted}")
        if any(w.shape != (self.count,) or w.strides != (8,) for w in white):
            raise ValueError(f"expected arrays of {self.count} numbers side by side")
        places = (ctypes.c_void_p * sets)(*(address(w) for w in white))
        stride = simulated.strides[0] // 8
        library.whiten(ctypes.byref(self._call), sets, address(simulated), stride, places)
        return True
