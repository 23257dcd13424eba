"""What a diagnosis is given: recordings, checked and put into runs to fit and runs to judge on."""

from __future__ import annotations

from collections.abc import Sequence

from corexy_fmi.engine.data.derived import without_derived
from corexy_fmi.engine.data.excerpts import excerpts, late_part, needed, restarted
from corexy_fmi.engine.data.preflight import check
from corexy_fmi.engine.data.samples import FEWEST, GAP, Run, judged, make_run, split_in_time
from corexy_fmi.engine.evidence import Finding
from corexy_fmi.errors import InputError
from corexy_fmi.kernel.layout import Layout
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording, with_even_stamps, with_lost_rows
from corexy_fmi.topology import STAGES


def preflight(
    recordings: Sequence[Recording], machine: Machine
) -> tuple[list[Recording], list[Finding]]:
    """Recordings put right where that is sure, with the rows that were lost, and what was found."""
    clocked = [with_even_stamps(r) for r in recordings]
    checked = [check(with_lost_rows(r), machine) for r, _ in clocked]
    sensed = [without_derived(r) for r, _ in checked]
    whole = [r for r, _ in sensed]
    told = [_scattered(r, scatter) for r, scatter in clocked if scatter]
    told += [f for a, b in zip(recordings, whole, strict=True) for f in _lost(a, b)]
    return whole, told + [f for _, found in (*checked, *sensed) for f in found]


def _scattered(even: Recording, scatter: float) -> Finding:
    """What to say of stamps that scatter."""
    text = (
        f"{even.name}: stamps scatter by {1e3 * scatter:.2g} ms (rms) about an even clock, over "
        "which the commanded angles are smooth"
    )
    return Finding(text, "Stamp rows when they are taken; the even clock is used here.")


def _lost(given: Recording, whole: Recording) -> list[Finding]:
    """What to say about rows that were put back."""
    count = len(whole) - len(given)
    if not count:
        return []
    text = f"{given.name}: {count} of {len(whole)} rows are missing"
    return [Finding(text, "Let the logger keep up; commands are led through them here.")]


def make_runs(
    train: Sequence[Recording],
    holdout: Sequence[Recording],
    machine: Machine,
    found: Sequence[Finding] = (),
) -> tuple[list[Run], list[Run]]:
    """Training and held-out runs; without the latter the last part of each is kept back, where it
    has samples.  Raises InputError for a recording without, which tells what was ``found`` in it,
    and for one to judge on that measures nothing that training did.
    """

    def sampled(run: Run, where: str = "") -> Run:
        if not run.samples:
            raise InputError(_unsampled(run, where, machine, found))
        return run

    if not holdout:
        halves = [split_in_time(r, machine, GAP) for r in train]
        runs = [sampled(a, " in its first 70 %") for a, _ in halves]
        late = [judged(b, [a]) for a, b in halves]
        return runs, [run for run in late if run.samples]
    runs = [sampled(make_run(r, machine, "train")) for r in train]
    kept = [sampled(make_run(r, machine, "holdout")) for r in holdout]
    known = ", ".join(dict.fromkeys(s.channel for run in runs for s in run.samples))
    for run in kept:
        if not judged(run, runs).samples:
            own = ", ".join(s.channel for s in run.samples)
            raise InputError(
                f"{run.name}: measures {own}, expected some of what is fitted: {known}"
            )
    return runs, kept


def _unsampled(run: Run, where: str, machine: Machine, found: Sequence[Finding]) -> str:
    """Why a run has nothing that can be fitted."""
    head = f"{run.name}: "
    why = [f.text.removeprefix(head) for f in found if f.text.startswith(head)]
    if machine.drive != "dc" and any(c.startswith("phi") for c in run.recording.measured):
        why.append("encoders are fitted with drive dc only")
    reason = f" ({'; '.join(why)})" if why else ""
    return (
        f"{head}no measured channel that can be fitted has more than {FEWEST} samples{where}"
        f"{reason}, expected x, y or ax, ay"
    )


def unjudged(
    runs: Sequence[Run], kept: Sequence[Run], holdout: Sequence[Recording]
) -> list[Finding]:
    """What to say of recordings of which nothing is kept back."""
    known = [run.recording for run in kept]
    names = [r.name for r in runs if not (holdout or any(r.recording is k for k in known))]
    text = f"nothing that is fitted has more than {FEWEST} samples in the last 30 %, which judge"
    return [Finding(f"{name}: {text}", "Record longer, or give --holdout.") for name in names]


def meaningless(runs: Sequence[Run], machine: Machine, layout: Layout) -> frozenset[str]:
    """Effects that these recordings cannot have: a delay where the clock is free; anything of the
    sensor where it is the loop's own, which then follows what the sensor says; what counts time
    from the start where excerpts are fitted.
    """
    names = {"sensor_delay"} if any(run.clock_free for run in runs) else set()
    if any(STAGES[machine.stage].direct) and all(map(_looped, runs)):
        names |= {i.effect.name for i in layout.instances if i.location == "sensor"}
    return frozenset(names) | (restarted(layout) if needed(runs) else frozenset())


def _looped(run: Run) -> bool:
    """Whether a loop runs on what is measured: a machine whose motor is fixed to its axis has one
    sensor, whose zero is then that of the references.
    """
    own = all(samples.channel in run.zeroed for samples in run.samples)
    return own and run.excitation.mode == "closed_loop"


def whole_runs(runs: Sequence[Run]) -> list[Run]:
    """The training runs to judge on where only excerpts are fitted; none where those will do."""
    return list(runs) if needed(runs) and not any(run.clock_free for run in runs) else []


def kept_parts(kept: Sequence[Run]) -> list[Run]:
    """The data kept back, without what a long run has before them; of free clocks excerpts."""
    free = any(run.clock_free for run in kept)
    return excerpts(kept) if free else [late_part(run) for run in kept]
