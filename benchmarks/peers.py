"""docs/speed.md: the same model and rectangle in other simulators, each with its error.

python -m benchmarks.peers             # measures all; a quiet machine, some minutes
python -m benchmarks.peers --short     # one machine, few repeats: to try it
python -m benchmarks.peers --render    # only the page and its figures, out of the stored JSON
python -m benchmarks.peers --check     # fails where the page is not what would be rendered

MuJoCo, CasADi and numba are the optional extra ``peers`` (pip install .[peers]); which are absent
stands in the outcome.  Writes benchmarks/results/peers.json; --short writes nothing.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.util
import json
import os
import sys
import time as clock
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from benchmarks import kernel_cost, peer_ours
from benchmarks.exact_stage import Array
from benchmarks.outcome import RESULTS, keep_page, write_outcome
from benchmarks.peer_casadi import casadi_run
from benchmarks.peer_case import HEIGHT, ROW, SPEED, WIDTH, Case
from benchmarks.peer_cvodes import cvodes_run
from benchmarks.peer_mujoco import Setting, mujoco_run
from benchmarks.peer_scheme import loops_run, numba_run, numpy_run
from benchmarks.peers_page import ALLOWED, PAGE, draw, page, selected
from benchmarks.smooth_stage import SmoothStage
from benchmarks.speed import processor
from corexy_fmi.kernel.call import LANES

MACHINES = ("yin2018", "gt2_printer")
NEEDED = {"mujoco": "MuJoCo", "casadi": "CasADi", "numba": "numba"}
COUNTS = (1, 2, 4, 5, 10, 20, 50, 100)  # micro-steps in a row, ours
CVODES = tuple((width, rtol) for width in (3e-6, 1e-6) for rtol in (1e-3, 1e-4, 1e-6))
SMOOTH = ((3e-6, 1e-3), (3e-6, 1e-4), (1e-6, 1e-4), (3e-7, 1e-5))  # width [m/s], rtol
MUJOCO_COUNTS = (2, 4, 5, 10, 20, 50)
SETS, TIMES, CORES = 1000, 4, 2  # of the batch; batches a process does in one go; processes
MOST, BUDGET, LONG = (
    60,
    0.6,
    3.0,
)  # repeats; seconds after which no further one, and no second one, is begun
Run = Callable[[], Array]


class Peer(NamedTuple):
    """One way to run the case: who, how, and what makes the function that is timed."""

    name: str
    setting: str
    make: Callable[[], Run]
    lanes: int = 1


def absent() -> list[str]:
    """Packages that are needed for a peer and are not there."""
    return [name for name in NEEDED if importlib.util.find_spec(name) is None]


def peers(case: Case, short: bool) -> Iterator[Peer]:
    """All ways to run a case, those of absent packages left out."""
    auto, missing = case.count, absent()
    step = f"{1e6 * ROW / auto:g} us"
    yield Peer("this kernel, 1 lane", f"{step} (automatic)", partial(peer_ours.lanes_run, case, 1))
    yield Peer(
        "this kernel, 8 lanes", f"{step} (automatic)", partial(peer_ours.lanes_run, case, 8), LANES
    )
    for count in COUNTS:
        if count != auto:
            make = partial(peer_ours.lanes_run, case, 1, ROW / count)
            yield Peer("this kernel, other steps", f"{1e6 * ROW / count:g} us", make)
    if "numba" not in missing:
        yield Peer("numba, same scheme, written out", step, partial(numba_run, case, auto))
        yield Peer("numba, same scheme, plain loops", step, partial(loops_run, case, auto))
    if "casadi" not in missing:
        yield Peer("CasADi, same scheme, generated C", step, partial(casadi_run, case, auto))
        for width, rtol in CVODES[1:2] if short else CVODES:
            setting = f"tanh(v / {1e6 * width:g} um/s), rtol {rtol:g}"
            yield Peer("CasADi CVODES", setting, partial(cvodes_run, case, width, rtol))
    yield Peer("NumPy loop, same scheme", step, partial(numpy_run, case, auto))
    if "mujoco" not in missing:
        yield from _mujoco(case, short)
    yield from _scipy(case, short)


def _mujoco(case: Case, short: bool) -> Iterator[Peer]:
    settings = [Setting(n, i, True) for n in MUJOCO_COUNTS for i in ("implicitfast", "Euler")]
    settings += [Setting(10, "implicitfast", False), Setting(10, "RK4", True)]
    for setting in settings[6:8] if short else settings:
        yield Peer("MuJoCo", str(setting), partial(mujoco_run, case, setting))


def _scipy(case: Case, short: bool) -> Iterator[Peer]:
    kinds = (("LSODA", False, SMOOTH), ("LSODA", True, SMOOTH), ("Radau", True, SMOOTH[::2]))
    for method, jacobian, settings in kinds:
        name = f"SciPy {method}{', Jacobian given' if jacobian else ''}"
        for width, rtol in SMOOTH[2:3] if short else settings:
            make = partial(_smooth_run, case, method, jacobian, width, rtol)
            yield Peer(name, f"tanh(v / {1e6 * width:g} um/s), rtol {rtol:g}", make)


def _smooth_run(case: Case, method: str, jacobian: bool, width: float, rtol: float) -> Run:
    stage = SmoothStage(case.machine.parameters, width)
    options: dict[str, Any] = {"rtol": rtol, "atol": 1e-3 * rtol}
    options |= {"jac": stage.jacobian} if jacobian else {}
    return lambda: stage.run(*case.path, ROW, method, **options)


def best(run: Callable[[], Any], budget: float) -> float:
    """Least wall time [s] of runs until a budget [s] is spent; two at least, unless one is long."""
    times: list[float] = []
    while sum(times) < (budget if len(times) > 1 else LONG) and len(times) < MOST:
        begin = clock.perf_counter()
        run()
        times.append(clock.perf_counter() - begin)
    return min(times)


def measured(peer: Peer, case: Case, budget: float) -> dict[str, Any]:
    """Seconds for a trajectory, its error, and what had to be made before."""
    begin = clock.perf_counter()
    run = peer.make()
    made, paths = clock.perf_counter() - begin, []
    with np.errstate(all="ignore"):
        seconds = best(lambda: paths.append(run()) if not paths else run(), budget)
        error = case.error(paths[0])
    good = bool(np.isfinite(error))
    return {
        "peer": peer.name,
        "setting": peer.setting,
        "seconds": seconds / peer.lanes if good else None,
        "error_um": error if good else None,
        "made_in": made,
    }


def machine(name: str, short: bool) -> dict[str, Any]:
    """All peers on one machine."""
    case, rows = Case.named(name), []
    for peer in peers(case, short):
        rows.append(measured(peer, case, 0.2 if short else BUDGET))
        _say(f"{name}: {peer.name}, {peer.setting}: {rows[-1]['seconds']} s")
    return {"machine": name, "surrogate": case.machine.surrogate, "seconds": case.seconds,
            "micro_steps": case.count * (len(case.travel) - 1), "points": rows}  # fmt: skip


def batch(name: str, short: bool) -> dict[str, Any]:
    """Seconds of a parameter set of a batch: the kernel and the numba port, one core and two."""
    sets, budget = (64, 0.2) if short else (SETS, 5 * BUDGET)
    kernel = peer_ours.kernel_batch(name, sets)
    found: dict[str, Any] = {"machine": name, "sets": sets, "cores": CORES}
    found["kernel"] = best(kernel, budget) / sets
    _say(f"{name}: a batch of {sets}")
    with peer_ours.processes(name, sets, CORES, TIMES) as once:
        rounds = [once() for _ in range(3 if short else 8)]
    found["kernel_processes"] = min(rounds) / (sets * TIMES * CORES)
    if "numba" not in absent():
        port = peer_ours.numba_batch(name, sets, False)
        found["largest_difference_um"] = float(1e6 * np.abs(port() - kernel()).max())
        found["numba"] = best(port, budget) / sets
        found["numba_threads"] = best(peer_ours.numba_batch(name, sets, True), budget) / sets
    return found


def costs(short: bool) -> dict[str, Any]:
    """What the kernel's time goes into."""
    case, repeats = Case.named(MACHINES[0]), 3 if short else 30
    found: dict[str, Any] = {"machine": MACHINES[0]}
    for part in ("share_of_peak", "over_sets", "over_length", "over_effects", "off_effects"):
        found[part] = getattr(kernel_cost, part)(case, repeats)
        _say(part.replace("_", " "))
    return found


def _say(what: str) -> None:
    print(what, file=sys.stderr)


def document(short: bool) -> dict[str, Any]:
    """All figures, with the load of the machine before, and after every part."""
    load, begin = [os.getloadavg()[0]], clock.perf_counter()
    names = MACHINES[:1] if short else MACHINES
    found: dict[str, Any] = {"machines": []}
    for name in names:
        found["machines"].append(machine(name, short))
        load.append(os.getloadavg()[0])
    found["batch"] = batch(names[0], short)
    load.append(os.getloadavg()[0])
    found["costs"] = costs(short)
    packages = ("numpy", "scipy", *NEEDED)
    return {
        **processor(),
        "cores": os.cpu_count(),
        "versions": {p: importlib.metadata.version(p) for p in packages if p not in absent()},
        "absent": absent(),
        "run": f"rectangle {WIDTH} m x {HEIGHT} m at {SPEED} m/s, rows every {ROW} s",
        "load_average": [round(x, 2) for x in [*load, os.getloadavg()[0]]],
        "took": clock.perf_counter() - begin,
        **found,
    }


def show(found: dict[str, Any]) -> None:
    """The chosen rows on the screen."""
    for one in found["machines"]:
        print(one["machine"])
        for row in selected(one["points"]):
            print(f"  {row['peer']:36s} {1e6 * row['seconds']:12.1f} us {row['error_um']:9.4f} um"
                  f"  {row['setting']}")  # fmt: skip
    print(
        "batch",
        {k: v if isinstance(v, int | str) else f"{v:.4g}" for k, v in found["batch"].items()},
    )
    print("share of peak", found["costs"]["share_of_peak"])
    print(f"absent: {', '.join(found['absent']) or 'none'}; {found['took']:.0f} s;"
          f" load average {found['load_average']}; allowed {ALLOWED} um")  # fmt: skip


def main() -> int:
    """Measure, render or check; the exit status."""
    parser = argparse.ArgumentParser(description="The same run in other simulators.")
    parser.add_argument("--short", action="store_true", help="one machine, write nothing")
    parser.add_argument("--render", action="store_true", help="run nothing")
    parser.add_argument("--check", action="store_true", help="write nothing, fail where stale")
    given = parser.parse_args()
    if not (given.render or given.check):
        if absent():
            _say(f"absent: {', '.join(absent())}; install the extra 'peers'")
        found = document(given.short)
        show(found)
        if given.short:
            return 0
        print(write_outcome("peers", "python -m benchmarks.peers", found))
    stored = json.loads((RESULTS / "peers.json").read_text(encoding="utf-8"))
    if not given.check:
        draw(stored)
    return keep_page(PAGE, page(stored), "python -m benchmarks.peers", check=given.check)


if __name__ == "__main__":
    sys.exit(main())
