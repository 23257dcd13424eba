"""The evidence that the report draws, out of a finished diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from corexy_fmi.engine.evidence import CornerSize, Evidence, Finding, Law, RunnerUp, Trace
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.engine.fitting.free_form import LawShape, law_errors, law_values
from corexy_fmi.engine.judging import locate
from corexy_fmi.engine.judging.model import Z95, covariance, tuned_machine
from corexy_fmi.engine.judging.prove import Proof, Replay
from corexy_fmi.engine.judging.verdict import Verdict
from corexy_fmi.engine.naming.entries import Competition, told
from corexy_fmi.kernel.call import Array
from corexy_fmi.machine import Machine
from corexy_fmi.simulate import simulate
from corexy_fmi.topology import STAGES

ARGUMENT_UNIT = {
    "vx": "m/s",
    "vy": "m/s",
    "x": "m",
    "y": "m",
    "phi1": "rad",
    "phi2": "rad",
    "t": "s",
}


def _on_rows(values: Array, index: np.ndarray, rows: int) -> Array:
    full = np.full(rows, np.nan)
    full[index] = values
    return full


def curves(replayed: Replay) -> dict[str, Array]:
    """What the sensor of every measured channel would show on all rows, by the clock and with the
    offset of the replay: none where a zero is known.
    """
    problem, u = replayed.fit.problem, replayed.fit.u[None]
    out, result = problem.shown(problem.lanes(u, 0), 0)[0], {}
    for c, (samples, errors) in enumerate(zip(replayed.run.samples, replayed.errors, strict=True)):
        offset = float(np.mean(samples.value - out[c, samples.index] - errors))
        result[samples.channel] = out[c] + offset
    return result


def _trace(proof: Proof, k: int, machine: Machine) -> Trace:
    run, rows = proof.runs[k], len(proof.runs[k].excitation.time)
    models = {state: curves(proof.replays[state][k]) for state in proof.replays}
    measured = {s.channel: _on_rows(s.value, s.index, rows) for s in run.samples}
    e, r = run.excitation, machine.parameters["pulley_radius"]
    angles = (e.input1, e.input2) if e.mode != "voltages" else (np.full(rows, np.nan),) * 2
    return Trace(
        run.name,
        run.role,
        e.time,
        measured,
        models["nominal"],
        models["retuned"],
        models["explained"],
        *STAGES[machine.stage].path(r, *angles),
    )


def _laws(fit: Fit) -> tuple[Law, ...]:
    """The free-form laws of a fit with their 95 % bands."""
    return tuple(_banded(fit, law) for law in fit.problem.hypothesis.laws)


def _banded(fit: Fit, law: LawShape) -> Law:
    values, spread = law_values(fit, law), Z95 * law_errors(fit, covariance(fit), law)
    return Law(
        law.location,
        law.argument,
        ARGUMENT_UNIT[law.argument],
        law.unit,
        np.array(law.knots),
        values,
        values - spread,
        values + spread,
        "free_form",
        law.acts,
    )


def _runners_up(competition: Competition) -> tuple[RunnerUp, ...]:
    rows = [
        RunnerUp(
            e.hypothesis.label.split(" at ")[0]
            if len(e.hypothesis.key) == 1
            else e.hypothesis.label,
            e.hypothesis.key[0][1] if len(e.hypothesis.key) == 1 else "",
            told(p),
            e.gain,
        )
        for e, p in zip(competition.entries, competition.probability, strict=True)
    ]
    retuned = RunnerUp("retuned_parameters", "", competition.nothing, 0.0)
    return tuple(sorted([*rows[:12], retuned], key=lambda row: -row.gain))


def _turns(path: Array) -> np.ndarray:
    """Rows at which the commanded direction changes by more than 30 degrees."""
    step = np.diff(path, axis=0)
    length = np.linalg.norm(step, axis=1)
    moving = np.minimum(length[1:], length[:-1]) > 0
    cosine = np.sum(step[1:] * step[:-1], axis=1) / np.maximum(length[1:] * length[:-1], 1e-300)
    return np.flatnonzero(moving & (cosine < np.cos(np.pi / 6))) + 1


def _miss(time: Array, path: Array, corner: Array, row: int) -> float:
    """Smallest distance [mm] of a path to a corner within half a second of the command."""
    first, last = np.searchsorted(time, time[row] + np.array([-0.6, 0.6]))
    near = first + np.flatnonzero(np.abs(time[first:last] - time[row]) < 0.5)
    return 1e3 * float(np.linalg.norm(path[near] - corner, axis=1).min())


def _corner(proof: Proof, fit: Fit, machine: Machine) -> CornerSize | None:
    """The corner of a training run that the effect moves most: its miss with and without [mm].

    "Without" is the explained machine with what was found switched off again.
    """
    k = next(k for k, run in enumerate(proof.runs) if run.role == "train")
    run, e = proof.runs[k], proof.runs[k].excitation
    if e.mode == "voltages" or machine.fidelity == "kinematic" or machine.kind.motors < 2:
        return None
    with_it = tuned_machine(fit, machine.name)
    without = replace(with_it, effects=machine.effects, free_forms=machine.free_forms)
    stage, radius = STAGES[machine.stage], with_it.parameters["pulley_radius"]
    command = np.column_stack(stage.path(radius, e.input1, e.input2))
    paths = [
        np.column_stack([r.channels["x"], r.channels["y"]])
        for r in (simulate(m, run.recording, fit.problem.layout) for m in (with_it, without))
    ]
    pairs = [tuple(_miss(e.time, p, command[row], row) for p in paths) for row in _turns(command)]
    if not pairs:
        return None
    worst = max(pairs, key=lambda pair: abs(pair[0] - pair[1]))
    return CornerSize(worst[0], worst[1], run.name)


def exhibit(
    verdict: Verdict,
    competition: Competition,
    fit: Fit,
    proof: Proof,
    machine: Machine,
    findings: Sequence[Finding],
) -> Evidence:
    """Everything that the report may draw."""
    left = verdict.left or verdict.stands
    traces = tuple(_trace(proof, k, machine) for k in range(len(proof.runs)))
    return Evidence(
        traces=traces,
        missing_forces=locate.missing_forces(proof, machine),
        laws=_laws(fit),
        spectra=locate.spectra(proof),
        runners_up=_runners_up(competition),
        corner=_corner(proof, fit, machine) if verdict.word != "nothing_missing" else None,
        preflight=tuple(findings),
        leftover=(left.gain, left.score) if left else None,
        machine_name=machine.name,
        surrogate=machine.surrogate,
        topology=machine.topology,
    )
