"""The closed loop: the real firmware moves the FMU, and what comes back is a recording."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from corexy_fmi.corners import corner_table
from corexy_fmi.fmu.runner import run_fmu
from corexy_fmi.hil.drive import Log
from corexy_fmi.hil.record import recording
from corexy_fmi.recording import Recording, read_recording, write_recording
from corexy_fmi.simulate import simulate
from tests.hil.kit import SHAPE, Bench, bench, jitter, order_of, step_ticks
from tests.hil.rig import Rig, Stage, fmu, yin

MICROSTEP = 2 * np.pi * 5e-3 / 3200  # [m] of belt


@dataclass
class Run:
    bench: Bench
    log: Log
    made: Recording


@pytest.fixture(scope="module")
def run():
    """One rectangle on the emulated board, in the loop with the FMU."""
    with Rig(Stage()) as rig:
        prepared = bench(rig)
        log = prepared.drive()
        made = recording("r.csv", log, prepared.board, prepared.tracker, prepared.begin, {})
        yield Run(prepared, log, made)


def test_commanded_acknowledged_and_emitted_steps_are_equal(run: Run) -> None:
    assert run.log.trouble == ""
    assert run.log.counts == run.bench.plan.counts == run.bench.rig.counts
    _, made = jitter(run.bench.rig, run.log)  # every step and its direction
    assert min(made) > 5000


def test_every_edge_lies_on_its_tick(run: Run) -> None:
    latest, _ = jitter(run.bench.rig, run.log)
    assert latest < 10  # [us]


def test_steps_are_wide_enough_for_the_driver(run: Run) -> None:
    edges = np.concatenate(run.bench.rig.edges)
    for bit in (2, 3):
        mine = edges[(edges["port"] == ord("D")) & (edges["bit"] == bit)]
        widths = np.diff(mine["cycle"].astype(np.int64)) / 16  # [us] high and low
        assert widths.min() >= 30


def test_direction_stands_before_the_step(run: Run) -> None:
    edges = np.concatenate(run.bench.rig.edges)
    edges = edges[edges["port"] == ord("D")]
    for step, direction in ((2, 5), (3, 6)):
        turns = edges[edges["bit"] == direction]["cycle"].astype(np.int64)
        ups = edges[(edges["bit"] == step) & (edges["level"] == 1)]["cycle"].astype(np.int64)
        assert len(turns) > 1
        after = ups[np.minimum(np.searchsorted(ups, turns), len(ups) - 1)] - turns
        assert after[after > 0].min() / 16 >= 30


def test_contour_errors_are_those_of_the_fmu(run: Run) -> None:
    direct = corner_table(run_fmu(fmu(), order_of()), SHAPE)
    through = corner_table(run.made, SHAPE)
    for mine, theirs in zip(through, direct, strict=True):
        assert abs(mine.contour_error - theirs.contour_error) < MICROSTEP
        assert abs(mine.overshoot - theirs.overshoot) < MICROSTEP


def test_recorded_command_is_the_command(run: Run) -> None:
    order, made = order_of(), run.made
    for name in ("phi1", "phi2"):
        wanted = np.interp(made.time, order.time, order[name])
        # half a tick at a corner, a quarter step of the path, half a step of the start
        limit = 0.75 * 2 * np.pi / 3200 + 8 * 40e-6
        assert np.abs(made[name] - wanted).max() < limit


def test_the_recorded_line_moves_the_model_as_the_steps_do(run: Run) -> None:
    plan = run.log.plan
    time = np.arange(0, plan.time[-1], 1e-3)
    line = {f"phi{m + 1}": np.interp(time, plan.time, plan.angles[:, m]) for m in (0, 1)}
    steps = {}
    for m in (0, 1):
        ticks, signs = step_ticks(plan, m)
        made = np.concatenate([[0], np.cumsum(signs)])
        passed = np.searchsorted(ticks * plan.scale.tick, time, side="right")
        steps[f"phi{m + 1}"] = plan.scale.angle(1) * made[passed]
    smooth, stepped = (simulate(yin(), Recording("r", time, c)) for c in (line, steps))
    for axis in "xy":
        apart = smooth[axis] - stepped[axis]
        assert np.sqrt(np.mean(apart**2)) < 2.5e-6  # [m] rms; a microstep is 9.8
        assert np.abs(apart).max() < MICROSTEP


def test_tracker_samples_keep_their_places(run: Run) -> None:
    taken = ~np.isnan(run.made["x"])
    truth = np.array(run.bench.rig.truth)
    x = run.made["x"][taken]
    assert set(x) <= set(truth[:, 1])
    assert np.count_nonzero(taken) >= 1000 * run.made.time[-1] - 2


def test_recording_reads_back(run: Run, tmp_path: Path) -> None:
    write_recording(run.made, tmp_path / "r.csv")
    again = read_recording(tmp_path / "r.csv")
    assert again.metadata["clock"] == "free"
    assert np.array_equal(again["phi1"], run.made["phi1"])


def test_host_streams_ahead(run: Run) -> None:
    assert run.log.buffered > 0.1
    assert run.log.sent_again == 0
    assert run.bench.board.status is not None
    assert run.bench.board.status.bytes_lost == 0
    assert run.bench.board.status.longest < 640  # [cycles] of a tick
