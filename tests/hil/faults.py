"""What goes wrong on a bench, played on the emulated board: `python -m tests.hil.faults`.

For each fault: how the run ended, how long after it the last step came, whether board and step
pins agree on the position, and whether the recording up to then is whole.
"""

from __future__ import annotations

import resource
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corexy_fmi.errors import InputError
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.drive import Drive, Log, Watcher
from corexy_fmi.hil.live import BEHIND, EVERY, LiveFile
from corexy_fmi.hil.port import LinkLostError
from corexy_fmi.hil.protocol import ADVICE, Type
from corexy_fmi.hil.record import recording
from corexy_fmi.recording import read_recording
from corexy_fmi.rectangle import Rectangle
from tests.hil.kit import Bench, bench
from tests.hil.rig import FREQUENCY, Rig

SHAPE = Rectangle(0.02, 0.014, 0.039, loops=2)
AT = 1.0  # [s] of the motion's recorded part at which a fault strikes
KILOBYTES = 20
Strike = Callable[[Bench, Drive], None]


@dataclass
class Outcome:
    """How a faulty run ended; ``last_step`` [ms] after the fault, NaN where it went to its end."""

    trouble: str
    last_step: float
    drivers_off: bool
    position_kept: bool
    known: bool
    complete: bool
    rows: int
    last_row: float
    frames_bad: int
    sent_again: int


@dataclass
class Case:
    """A fault: one that strikes once, or one that spoils the link from the start."""

    name: str
    strike: Strike | None = None
    spoil: Callable[[Rig], None] | None = None


def spoiler(rng: np.random.Generator, flip: float = 0.0, lose: float = 0.0) -> Callable:
    """Flips one bit of, or loses, that share of the bytes."""

    def spoil(data: bytes) -> bytes:
        raw = np.frombuffer(data, np.uint8).copy()
        hit = rng.random(len(raw)) < flip
        raw[hit] ^= (1 << rng.integers(0, 8, hit.sum())).astype(np.uint8)
        return raw[rng.random(len(raw)) >= lose].tobytes()

    return spoil


def both_ways(flip: float = 0.0, lose: float = 0.0) -> Callable[[Rig], None]:
    def install(rig: Rig) -> None:
        rng = np.random.default_rng(1)
        rig.to_board, rig.to_host = spoiler(rng, flip, lose), spoiler(rng, flip, lose)

    return install


def duplicated(rig: Rig) -> None:
    """Every tenth frame comes twice."""
    rng = np.random.default_rng(2)
    rig.to_board = lambda data: data * 2 if rng.random() < 0.1 else data


def delayed(rig: Rig) -> None:
    """Every tenth frame comes after the four that follow it."""
    rng, held = np.random.default_rng(3), []

    def late(data: bytes) -> bytes:
        if not held and rng.random() < 0.1:
            held.extend([data, 4])
            return b""
        if held:
            held[1] -= 1
            if held[1] == 0:
                data += held[0]
                held.clear()
        return data

    rig.to_board = late


def garbage(prepared: Bench, drive: Drive) -> None:
    """Another device talks on the line, both ways, 300 bytes."""
    noise = np.random.default_rng(4).integers(0, 256, 300, dtype=np.uint8).tobytes()
    prepared.rig.emulator.write(noise)
    prepared.board.decoder.feed(noise)


def unplugged(prepared: Bench, drive: Drive) -> None:
    """The port goes away for a second."""
    rig = prepared.rig
    back = rig.now() + 1.0

    def reopen() -> bool:
        rig.read(0.0)
        return rig.now() > back

    rig.reopen = reopen  # type: ignore[method-assign]
    raise LinkLostError("unplugged")


def paused(prepared: Bench, drive: Drive) -> None:
    """The host does nothing for a second; bytes wait in its system."""
    waiting = b"".join(prepared.rig.read(0.0) for _ in range(1000))
    prepared.board.decoder.feed(waiting)


class KilledError(BaseException):
    """Nobody catches it: the host is gone."""


def killed(prepared: Bench, drive: Drive) -> None:
    """The host's process ends at once; a new one asks for the counts a second later."""
    read = prepared.rig.read

    def gone(wait: float) -> bytes:
        raise KilledError

    def again() -> None:
        prepared.rig.read = read  # type: ignore[method-assign]

    prepared.rig.read, prepared.rig.revive = gone, again  # type: ignore[method-assign]
    raise KilledError


def interrupted(prepared: Bench, drive: Drive) -> None:
    raise KeyboardInterrupt


CASES = (
    Case("1 % of bytes flipped", spoil=both_ways(flip=0.01)),
    Case("5 % of bytes flipped", spoil=both_ways(flip=0.05)),
    Case("1 % of bytes lost", spoil=both_ways(lose=0.01)),
    Case("5 % of bytes lost", spoil=both_ways(lose=0.05)),
    Case("frames duplicated", spoil=duplicated),
    Case("frames delayed", spoil=delayed),
    Case("garbage on the line", garbage),
    Case("unplugged for 1 s", unplugged),
    Case("host paused 1 s", paused),
    Case("host killed", killed),
    Case("board reset", lambda b, d: b.rig.emulator.reset()),
    Case("e-stop pressed", lambda b, d: b.rig.emulator.pin("C0", 1)),
    Case("e-stop frame", lambda b, d: b.board.send(Type.ESTOP)),
    Case("limit switch", lambda b, d: b.rig.emulator.pin("B1", 1)),
    Case("Ctrl-C", interrupted),
    Case("full disk"),
)


def play(case: Case) -> Outcome:
    """One run with its fault."""
    with Rig() as rig, tempfile.TemporaryDirectory() as folder:
        prepared = bench(rig, SHAPE)
        if case.spoil is not None:
            case.spoil(rig)
        struck = _Strike(case, prepared)
        part = Path(folder) / "run.part.csv"
        live = LiveFile(part, prepared.begin, {})

        def watch(drive: Drive) -> None:
            struck(drive)
            try:
                live(drive)
            except InputError:
                struck.cycle = rig.emulator.cycle
                raise

        limit = resource.getrlimit(resource.RLIMIT_FSIZE)
        if case.name == "full disk":
            resource.setrlimit(resource.RLIMIT_FSIZE, (KILOBYTES * 1024, limit[1]))
        try:
            with live:
                log = _driven(prepared, watch)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        return _outcome(prepared, log, struck, part)


def _driven(prepared: Bench, watch: Watcher) -> Log:
    """The log of a run; of one whose host is killed, what a new host finds a second later."""
    drive = Drive(prepared.board, prepared.plan, prepared.tracker, watch)
    try:
        return drive.run()
    except KilledError:
        prepared.rig.revive()
        for _ in range(1000):
            prepared.rig.read(0.0)
        board = Board(prepared.rig)
        board.connect()
        status = board.fresh_status()
        drive.log.counts, drive.log.cause = status.counts, status.fault
        drive.log.trouble = f"nothing; a new host hears: {ADVICE[status.fault]}"
        return drive.log


class _Strike:
    """Strikes once, and remembers when."""

    def __init__(self, case: Case, prepared: Bench) -> None:
        self._case, self._prepared = case, prepared
        self.cycle: int | None = None
        self.strikes = case.spoil is None

    def __call__(self, drive: Drive) -> None:
        if self.cycle is None and drive.time >= self._prepared.begin + AT:
            self.cycle = self._prepared.rig.emulator.cycle
            if self._case.strike is not None:
                self._case.strike(self._prepared, drive)


def _outcome(prepared: Bench, log: Log, struck: _Strike, part: Path) -> Outcome:
    rig = prepared.rig
    before = rig.counts
    for _ in range(300):  # whatever still moves would be seen
        rig.read(0.0)
    assert rig.counts == before, "steps after the end of the run"
    assert rig.edges, f"nothing moved: {log.trouble}"
    steps = max(int(rig.rising(bit)[0].max(initial=0)) for bit in (2, 3))
    since = float("nan") if struck.cycle is None else steps - struck.cycle
    late = max(since / FREQUENCY * 1e3, 0.0)
    rows = len(read_recording(part)) if log.played() > prepared.begin + BEHIND + EVERY else 0
    off = bool(rig.emulator.memory_at(0x25) & 1)  # PORTB: the drivers' pin is high
    return Outcome(
        trouble=log.trouble,
        last_step=late if log.trouble and struck.strikes else float("nan"),
        drivers_off=off,
        position_kept=log.counts == rig.counts,
        known=log.known,
        complete=log.complete,
        rows=rows,
        last_row=_last_row(prepared, log),
        frames_bad=log.frames_bad,
        sent_again=log.sent_again,
    )


def _last_row(prepared: Bench, log: Log) -> float:
    """Time [s] at which the recording ends; NaN if it stopped before it began."""
    if log.played() <= prepared.begin:
        return float("nan")
    made = recording("r.csv", log, prepared.board, prepared.tracker, prepared.begin, {})
    return float(made.time[-1])


def stranger() -> str:
    """What is said about a port at which something else talks."""
    with Rig() as rig:
        rig.to_host = lambda data: b"ok\r\nGrbl 1.1h ['$' for help]\r\n"
        try:
            Board(rig).connect()
        except InputError as error:
            return str(error)
    return ""


def main() -> None:
    """Print the table."""
    from rich.console import Console
    from rich.table import Table

    names = ("fault", "last step after (ms)", "drivers", "counts = pins", "known", "rows", "said")
    table = Table(*names)
    for case in CASES:
        o = play(case)
        said = o.trouble or f"complete; {o.frames_bad} spoiled, {o.sent_again} sent again"
        late = "to the end" if o.complete else "ramp" if np.isnan(o.last_step) else ""
        late = late or f"{o.last_step:.2f}"
        drivers = "off" if o.drivers_off else "on"
        kept = "yes" if o.position_kept else "no"
        known = "yes" if o.known else "no"
        table.add_row(case.name, late, drivers, kept, known, str(o.rows), said)
    table.add_row("another device", "nothing moved", "off", "", "", "", stranger())
    Console(width=170).print(table)


if __name__ == "__main__":
    main()
