"""What `corexy hil check, monitor, release, home` do on a GRBL controller."""

from __future__ import annotations

import numpy as np
from rich.live import Live
from rich.table import Table

from corexy_fmi.commands.hil_grbl_plan import home, plugged
from corexy_fmi.commands.screen import cells, console, say
from corexy_fmi.errors import InputError
from corexy_fmi.hil.grbl_limits import warnings
from corexy_fmi.hil.grbl_link import BAUD, POLL, Heard, Link
from corexy_fmi.hil.port import LinkLostError, SerialPort

SHOWN = {  # settings, and what they are
    0: "step pulse (us)", 1: "drivers off after (ms, 255 never)", 11: "junction deviation (mm)",
    20: "soft limits", 21: "hard limits", 22: "homing", 100: "steps/mm", 110: "motor 1 (mm/min)",
    111: "motor 2 (mm/min)", 120: "motor 1 (mm/s^2)", 121: "motor 2 (mm/s^2)",
    130: "travel x (mm)", 131: "travel y (mm)",
}  # fmt: skip


def connected(port: str) -> Link:
    """A controller that has said who it is."""
    link = Link(SerialPort(port, BAUD))
    with plugged(port):
        link.connect()
    return link


def show_controller(port: str, seconds: float) -> None:
    """Who it is, how it is set, and how fast it answers for a time [s]; moves nothing."""
    link = connected(port)
    reports: list[Heard] = []
    began = link.port.now()
    with plugged(port):
        while link.port.now() - began < seconds:
            link.ask()
            reports += link.poll()
    table = Table("what", "value")
    for what, value in [*_firmware(link), *_settings(link), *_answers(reports)]:
        table.add_row(*cells(what, value))
    console().print(table)
    assert link.build is not None
    for warning in warnings(link.settings, link.build):
        say(f"warning: {warning}")


def _firmware(link: Link) -> list[tuple[str, str]]:
    build, last = link.build, link.last
    assert build is not None
    assert last is not None
    known = {True: "yes", False: "no: build it with COREXY", None: "not told"}[build.corexy]
    return [
        ("firmware", f"{build.family.value} {build.version}"),
        ("Core-XY", known),
        ("F for 1 mm/min of the head", f"{build.feed_factor:.4f}"),
        ("buffers", f"{build.buffer} bytes, {build.blocks} motions ahead"),
        ("state", last.report.state),
        ("commanded position (mm)", "{:.3f}, {:.3f}".format(*link.locate())),
        ("switches closed", last.report.pins or "none"),
    ]


def _settings(link: Link) -> list[tuple[str, str]]:
    return [(f"${n} {what}", f"{link.settings[n]:g}") for n, what in SHOWN.items()
            if n in link.settings]  # fmt: skip


def _answers(reports: list[Heard]) -> list[tuple[str, str]]:
    if not reports:
        return [("reports", "none")]
    trips = [1e3 * (one.heard - one.sent) for one in reports]
    half, most = np.quantile(trips, [0.5, 1.0])
    return [("reports", f"{len(reports)}, asked every {POLL:g} s"),
            ("round trip", f"{half:.2f} ms, at most {most:.2f} ms")]  # fmt: skip


def show_reports(port: str, seconds: float | None) -> None:
    """The controller's reports, until the time [s] is over or Ctrl-C."""
    link = Link(SerialPort(port, BAUD))
    with plugged(port):
        link.listen()
    began = link.port.now()
    with Live(_view(link), console=console(), auto_refresh=False) as live:
        try:
            while seconds is None or link.port.now() - began < seconds:
                link.ask()
                if link.poll(0.02):
                    live.update(_view(link), refresh=True)
        except KeyboardInterrupt:
            return
        except LinkLostError as error:
            say(f"link lost: {error}")


def _view(link: Link) -> Table:
    table = Table("state", "commanded x (mm)", "commanded y (mm)", "feed", "switches", "free")
    if link.last is not None:
        report = link.last.report
        place = report.place(link.offset) or ("", "")
        table.add_row(*cells(report.state, *place, "" if report.feed is None else report.feed,
                             report.pins, report.free or ""))  # fmt: skip
    return table


def release_controller(port: str) -> None:
    """`$SLP`: drivers off until a reset; InputError where it is not idle."""
    with plugged(port):
        connected(port).command("$SLP")


def home_controller(port: str, arm: bool) -> None:
    """`$H`, where ``arm`` says so."""
    link = connected(port)
    if not link.settings.get(22):
        raise InputError("controller: $22=0, homing is off, expected limit switches and $22=1")
    if not arm:
        say("dry run, nothing moves: add --arm to find the switches")
        return
    with plugged(port):
        centre = home(link)
        x, y = link.locate()
    say(f"homed: it stands at {x:.3f}, {y:.3f} mm; the middle of its travel is "
        f"{centre[0]:.3f}, {centre[1]:.3f} mm")  # fmt: skip
