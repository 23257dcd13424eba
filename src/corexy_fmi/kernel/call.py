"""Call the compiled kernel: one recording, any number of parameter sets, and inputs of each."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.kernel.clock import restamp
from corexy_fmi.kernel.compiler import NoCompilerError, kernel_library
from corexy_fmi.kernel.layout import Layout
from corexy_fmi.kernel.spare import shared
from corexy_fmi.topology import STAGES

Array = NDArray[np.float64]
MOTION = ("x", "y", "vx", "vy", "ax", "ay", "phi1", "phi2", "x_true", "y_true")
MOTORS = ("omega1", "omega2", "torque1", "torque2", "V1", "V2")
OUTPUTS = (*MOTION, *MOTORS, *(f"tension{i + 1}" for i in range(12)))
MODES = {"angles": 0, "voltages": 1, "closed_loop": 2}
LANES = 8
# what a run begins with: how far x and y are off [m]; of the friction of the idlers, how much the
# last turn of each motor left them (-1 .. 1: all of it, either way); and how far each rotor that is
# free to turn is off its command [rad], the axes along
DEFLECTED = ("deflection along x", "deflection along y")
IDLERS = ("idlers since motor 1", "idlers since motor 2")
ROTORS = ("motor 1 off its command", "motor 2 off its command")
REST = (*DEFLECTED, *IDLERS, *ROTORS)
# and where it begins in motion: how far it is off its even course, in place, then in speed
ENDS = ("x", "y", "motor 1", "motor 2")
PUSH = (*(f"start of {end}" for end in ENDS), *(f"start speed of {end}" for end in ENDS))
PLACES = {name: place for place, name in enumerate(STAGES)}
LONG_RUN = 100_000  # rows


class _Batch(ctypes.Structure):
    """`batch` of batch.c."""

    _fields_ = (
        *((n, ctypes.c_int) for n in ("rows", "mode", "topology", "drive", "sets", "apart")),
        *((n, ctypes.c_void_p) for n in ("time", "input1", "input2")),
        *((n, ctypes.c_double) for n in ("kp", "kd", "rate_weight", "limit", "lead")),
        *((n, ctypes.c_void_p) for n in ("parameter", "first", "rest", "push", "channel")),
        ("channels", ctypes.c_int),
        ("out", ctypes.c_void_p),
        ("step", ctypes.c_double),
    )
    held: object  # what the pointers lead to, for as long as a thread may write there


@dataclass(frozen=True)
class Excitation:
    """What drives a run: times [s] (n,), two inputs (n,), and what they are.

    ``mode``: "angles" [rad], linear between rows; "voltages" [V], held; "closed_loop": references
    [rad] of a PD law on the rotor angles, V_n = kp (ref_n - phi_n) + kd (w slope_n - omega_n), held
    from row n to the next; slope_n is the reference's on the interval that starts at row n, w the
    ``rate_weight``.  A run begins at rest; where ``lead`` [s] is given, in even motion that long
    before its first row, at the rate of its first interval (not where voltages drive it).
    """

    time: Array
    input1: Array
    input2: Array
    mode: str = "angles"
    kp: float = 0.0
    kd: float = 0.0
    first_angles: tuple[float, float] | None = None
    rate_weight: float = 1.0
    lead: float = 0.0

    def start(self) -> tuple[float, float]:
        """Motor angles [rad] at which the run rests at first."""
        if self.first_angles is not None:
            return self.first_angles
        if self.mode == "voltages":
            return 0.0, 0.0
        return float(self.input1[0]), float(self.input2[0])

    def of_set(self, inputs: Array | None, n: int | np.integer) -> Excitation:
        """The n-th set's own, where ``inputs`` (2, sets, rows) stand in place of this one's."""
        if inputs is None:
            return self
        return replace(self, input1=inputs[0, n], input2=inputs[1, n])


@cache
def _library(layout: Layout, lanes: int) -> ctypes.CDLL:
    library = ctypes.CDLL(str(kernel_library(layout, lanes)))
    library.batch_run.argtypes = [ctypes.POINTER(_Batch)]
    return library


@cache
def has_kernel(layout: Layout, lanes: int) -> bool:
    """Whether there is a compiled kernel, or a compiler to make one."""
    try:
        _library(layout, lanes)
    except NoCompilerError:
        return False
    return True


def _interruptible(function: Callable[..., int], call: _Batch, rows: int) -> int:
    """Call the kernel; a long run goes to a thread, so that Ctrl-C reaches the main thread."""
    if rows < LONG_RUN or threading.current_thread() is not threading.main_thread():
        return function(ctypes.byref(call))
    status: list[int] = []
    worker = threading.Thread(
        target=lambda: status.append(function(ctypes.byref(call))), daemon=True
    )
    worker.start()
    while worker.is_alive():
        worker.join(0.1)
    return status[0]


def address(array: np.ndarray) -> int:
    """Where an array's numbers lie; a fifth of the time of ``array.ctypes.data``."""
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(array))  # type: ignore[arg-type]
    except (TypeError, ValueError):  # it may not be written, or holds nothing
        return int(array.ctypes.data)


@lru_cache(maxsize=256)
def _wanted(channels: tuple[str, ...]) -> ctypes.Array[ctypes.c_int]:
    """The outputs' places."""
    return (ctypes.c_int * len(channels))(*(OUTPUTS.index(c) for c in channels))


def _fill(
    layout: Layout,
    e: Excitation,
    inputs: Array | None,
    parameters: Array,
    stage: tuple[str, bool],
    begun: tuple[Array, Array],
    channels: tuple[str, ...],
    limit: float,
    out: Array,
) -> float:
    """All sets into out (sets, channels, rows); ``inputs`` are each set's own, if any; ``stage`` is
    the fidelity, and whether it is DC, ``begun`` what the sets begin with: rest (sets, 6) and push
    (sets, 8).  Idle threads take some of the blocks of sets that run together.

    Returns the longest step [s] of the last block.
    """
    (fidelity, dc), width = stage, _width(len(parameters))
    first = np.array([e.of_set(inputs, n).start() for n in range(len(parameters))])
    wanted, function = _wanted(channels), _library(layout, width).batch_run
    apart = inputs is not None
    common = [_held(a) for a in (e.time, e.input1, e.input2)]
    steps = np.zeros(-(-len(parameters) // width))

    def run(block: int) -> None:
        some = slice(block * width, (block + 1) * width)
        own = [_held(a[some]) for a in (parameters, first, *begun)]
        driven = common[1:] if inputs is None else [_held(a[some]) for a in inputs]
        into = out[some]
        call = _Batch(
            *(len(e.time), MODES[e.mode], PLACES[fidelity], dc, len(into), apart),
            *map(address, (common[0], *driven)),
            *(e.kp, e.kd, e.rate_weight, limit, e.lead),
            *map(address, own),
            *(ctypes.addressof(wanted), len(wanted), address(into)),
        )
        call.held = common, driven, own, wanted, into
        if _interruptible(function, call, len(e.time)):
            raise MemoryError("the kernel found no memory for a run")
        steps[block] = call.step

    shared(run, range(len(steps)))
    return float(steps[-1])


def _held(array: Array) -> Array:
    return np.ascontiguousarray(array, dtype=np.float64)


def _width(sets: int) -> int:
    """How many sets run together."""
    return 1 if sets == 1 else LANES


def _check_shapes(
    layout: Layout, e: Excitation, inputs: Array | None, parameters: Array, *begun: Array | None
) -> None:
    """The library reads as far as it is told to."""
    lengths = {len(e.time), len(e.input1), len(e.input2)}
    if len(lengths) != 1 or 0 in lengths:
        raise ValueError(f"time and inputs have {sorted(lengths)} rows, expected one number")
    if parameters.ndim != 2 or parameters.shape[1] != layout.parameters:
        raise ValueError(f"parameters {parameters.shape}, expected (sets, {layout.parameters})")
    driven = (2, len(parameters), len(e.time))
    if inputs is not None and inputs.shape != driven:
        raise ValueError(f"inputs {inputs.shape}, expected {driven}")
    for name, given, size in zip(("rest", "push"), begun, (len(REST), len(PUSH)), strict=False):
        if given is not None and given.shape != (len(parameters), size):
            raise ValueError(f"{name} {given.shape}, expected ({len(parameters)}, {size})")


def run_lanes(
    layout: Layout,
    excitation: Excitation,
    parameters: Array,
    *,
    inputs: Array | None = None,
    fidelity: str = "full",
    dc: bool = False,
    rest: Array | None = None,
    push: Array | None = None,
    channels: tuple[str, ...] = ("x", "y"),
    limit: float = 0.0,
) -> Array:
    """Run every parameter set through one excitation, or through inputs of its own.

    ``parameters`` (sets, layout.parameters); ``inputs`` (2, sets, rows): what stands for the
    excitation's two inputs in each set; ``rest`` (sets, 6): what each set begins
    with (`REST`); ``push`` (sets, 8): how far x, y, both motors [m, rad] and their speeds
    are off where a lead ends (`PUSH`); ``limit`` the longest micro-step [s], 0: from the fastest
    pole of the sets that run together.
    Returns (sets, channels, rows).  Sets run in blocks of eight in their order, so the result
    never depends on who calls.  Where there is no compiler Python does it, slowly (see
    `without_compiler`).  Raises ValueError where shapes do not fit.
    """
    _check_shapes(layout, excitation, inputs, parameters, rest, push)
    sets = len(parameters)
    begun = (
        np.zeros((sets, len(REST))) if rest is None else rest,
        np.zeros((sets, len(PUSH))) if push is None else push,
    )
    if not has_kernel(layout, _width(sets)):
        from corexy_fmi.kernel.without_compiler import run_slowly

        return run_slowly(
            layout,
            excitation,
            parameters,
            inputs=inputs,
            fidelity=fidelity,
            dc=dc,
            begun=begun,
            channels=channels,
            limit=limit,
        )
    out = np.empty((sets, len(channels), len(excitation.time)))
    _fill(layout, excitation, inputs, parameters, (fidelity, dc), begun, channels, limit, out)
    restamp(layout, parameters, excitation.time, channels, out)
    return out


def step_limit(
    layout: Layout, parameters: Array, *, fidelity: str = "full", dc: bool = False
) -> float:
    """Longest micro-step [s] that resolves the fastest pole of one parameter set, at the centre."""
    if not has_kernel(layout, 1):
        from corexy_fmi.kernel.without_compiler import slow_step_limit

        return slow_step_limit(layout, parameters, fidelity, dc)
    still = Excitation(np.zeros(1), np.zeros(1), np.zeros(1))
    rest, out = np.zeros((1, len(REST))), np.empty((1, 1, 1))
    begun = rest, np.zeros((1, len(PUSH)))
    return _fill(layout, still, None, parameters[None], (fidelity, dc), begun, ("x",), 0.0, out)
