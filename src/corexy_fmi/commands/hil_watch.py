"""What `corexy hil check` and `corexy hil monitor` show."""

from __future__ import annotations

import time

import numpy as np
from rich.live import Live
from rich.table import Table

from corexy_fmi.commands.screen import cells, console, say
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.drive import AHEAD
from corexy_fmi.hil.port import LinkLostError
from corexy_fmi.hil.protocol import Flag, Status

REFRESH = 10  # [Hz]
WAKES = 500  # sleeps that are timed


def show_link(board: Board, seconds: float) -> None:
    """Listen for a time [s], then say how good the link is."""
    board.fresh_status()  # reports that waited in the port are taken
    reports: list[Status] = []
    board.listeners.append(lambda m, now: reports.append(m) if isinstance(m, Status) else None)
    began = board.port.now()
    while board.port.now() - began < seconds:
        board.keep_alive()
        board.poll()
    table = Table("what", "value")
    for what, value in [
        *_firmware(board),
        *_link(board, reports, seconds),
        *_host(),
    ]:
        table.add_row(*cells(what, value))
    console().print(table)


def _firmware(board: Board) -> list[tuple[str, str]]:
    info, status = board.info, board.status
    assert info is not None
    assert status is not None
    kind = "stepper" if info.kind == "S" else "dc"
    flags = status.flags
    switches = [f.name for f in (Flag.SWITCH_X, Flag.SWITCH_Y, Flag.ESTOP_OPEN) if f in flags]
    return [
        ("firmware", f"{kind}, protocol {info.version}, {info.tick_hz} ticks/s"),
        ("state", f"{status.state.name.lower()}, last stop: {status.fault.name.lower()}"),
        ("position known", "yes" if Flag.POSITION_KNOWN in flags else "no: --home or --centred"),
        ("drivers", "on" if Flag.DRIVERS_ON in flags else "off"),
        ("open switches", ", ".join(str(name).lower() for name in switches) or "none"),
    ]


def _link(board: Board, reports: list[Status], seconds: float) -> list[tuple[str, str]]:
    status = board.status
    assert status is not None
    trips = 1e3 * board.clock.round_trips
    lines = [
        ("reports", f"{len(reports)} in {seconds:g} s, {board.decoder.bad} spoiled here"),
        ("spoiled at the board", f"{status.frames_bad} frames, {status.bytes_lost} bytes"),
        ("longest interrupt", f"{status.longest} cycles"),
    ]
    if len(trips):
        half, most = np.quantile(trips, [0.5, 0.99])
        offset, rate = board.clock.fit()
        lines += [
            ("round trip", f"{half:.2f} ms, 99 % below {most:.2f} ms, {len(trips)} tries"),
            ("clock offset", f"{offset:.6f} s"),
            ("clock drift", f"{1e6 * (rate - 1):.1f} ppm" if rate != 1 else "needs 20 s"),
        ]
    return lines


def _host() -> list[tuple[str, str]]:
    """How late this host wakes from a sleep of 1 ms; what streams ahead must outlast it."""
    late = []
    for _ in range(WAKES):
        asked = time.perf_counter() + 1e-3
        time.sleep(1e-3)
        late.append(1e3 * (time.perf_counter() - asked))
    half, most, worst = np.quantile(late, [0.5, 0.99, 1.0])
    shown = f"late by {half:.2f} ms, 99 % below {most:.2f} ms, at most {worst:.2f} ms"
    slow = worst > 1e3 * AHEAD
    return [("this host wakes", shown + (": too slow to stream, close programs" if slow else ""))]


def show_live(board: Board, seconds: float | None) -> None:
    """The board's reports, until the time [s] is over or Ctrl-C."""
    began = drawn = time.monotonic()
    with Live(_view(board), console=console(), refresh_per_second=REFRESH) as live:
        try:
            while seconds is None or time.monotonic() - began < seconds:
                board.keep_alive()
                board.poll()
                if time.monotonic() - drawn > 1 / REFRESH:
                    live.update(_view(board))
                    drawn = time.monotonic()
        except KeyboardInterrupt:
            return
        except LinkLostError as error:
            say(f"link lost: {error}")


def _view(board: Board) -> Table:
    table = Table("state", "last stop", "motor 1", "motor 2", "free", "flags", "time (s)")
    status, info = board.status, board.info
    if status is not None and info is not None:
        table.add_row(
            *cells(
                status.state.name.lower(),
                status.fault.name.lower(),
                *status.counts,
                status.free,
                " ".join(str(f.name).lower() for f in status.flags),
                f"{status.tick / info.tick_hz:.2f}",
            )
        )
    return table
