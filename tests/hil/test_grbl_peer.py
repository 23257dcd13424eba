"""A real GRBL, of the user's choice: COREXY_GRBL_PORT names its port; it moves 20 x 14 mm.

An emulated or a bare board will do; where motors hang on it, the carriage must be in the middle.
"""

from __future__ import annotations

import os
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from corexy_fmi.commands.hil_grbl import execute_grbl
from corexy_fmi.commands.hil_run import Setup
from corexy_fmi.hil.grbl_drive import Drive
from corexy_fmi.hil.grbl_link import BAUD, Link
from corexy_fmi.hil.grbl_report import Family
from corexy_fmi.hil.port import SerialPort
from corexy_fmi.machine import load_machine
from tests.hil.grbl_kit import SHAPE, order_of

PORT = os.environ.get("COREXY_GRBL_PORT", "")
pytestmark = pytest.mark.skipif(not PORT, reason="no COREXY_GRBL_PORT: a GRBL controller's port")


@pytest.mark.parametrize("acceleration", [None, 1.0])
def test_rectangle(tmp_path: Path, acceleration: float | None) -> None:
    machine, shape = load_machine("yin2018"), replace(SHAPE, loops=3, acceleration=acceleration)
    counts = 3200
    setup = Setup(
        machine=machine, port=PORT, out=tmp_path / "r.csv", counts=counts, centred=True, arm=True
    )
    made = execute_grbl(setup, order_of(shape))
    assert made is not None
    order = order_of(shape)
    print(made.metadata["timing"], f"asked={order.time[-1]:.4f}")
    gap = float(made.metadata["timing"].split("gap=")[1].split()[0])
    assert gap < 100e-6
    assert made.time[-1] == pytest.approx(order.time[-1], rel=0.1)
    back = link_at_rest()
    x, y = back.locate()
    back.command(f"G21G90G94G1X{x + 10:.3f}Y{y + 7:.3f}F600")  # to the middle again
    while back.fresh().report.state != "Idle":
        pass
    back.port.close()


def link_at_rest() -> Link:
    link = Link(SerialPort(PORT, BAUD))
    link.connect()
    return link


@pytest.mark.parametrize("mode", ["G94", "G93"])
def test_feed_rule(mode: str) -> None:
    """Of a long side, at 20 mm/s: what F means to this firmware, and that G93 differs."""
    link = link_at_rest()
    assert link.build is not None
    link.locate()
    assert link.last is not None
    x, y = link.last.report.place(link.offset) or (0.0, 0.0)
    feeds = {"G94": "F1200", "G93": "F60"}  # 20 mm in 1 s, if F were the head's
    spans = []
    for goal in (x + 20, x):
        began = time.perf_counter()
        drive = Drive(link, [f"G21G90{mode}G1X{goal:.3f}Y{y:.3f}{feeds[mode]}", "G4P0.01", "G94"])
        assert drive.run().trouble == ""
        spans.append(drive.log.answered[1] - began)
    link.port.close()
    grbl = link.build.family is Family.GRBL
    factor = {("G94", True): 2**0.5, ("G93", True): 1.0, ("G94", False): 1.0,
              ("G93", False): 2**-0.5}[mode, grbl]  # fmt: skip
    print(mode, spans, "expected", factor)
    assert np.mean(spans) == pytest.approx(factor + 0.05, abs=0.1)


def test_hold_keeps_the_place() -> None:
    link = link_at_rest()
    x, y = link.locate()

    def watch(drive: Drive) -> None:
        if drive.log.reports and drive.log.reports[-1].report.state == "Run":
            raise KeyboardInterrupt

    lines = ["G21G90G94"]
    goals = [(x + 8, y), (x, y + 8), (x - 8, y), (x, y)]
    lines += [f"G1X{a:.3f}Y{b:.3f}F1200" for a, b in goals] + ["G4P0.01"]
    log = Drive(link, lines, watch=watch).run()
    assert (log.trouble, log.known) == ("interrupted", True)
    assert log.place is not None
    inside = [np.hypot(log.place[0] - a, log.place[1] - b) < 12 for a, b in goals]
    assert any(inside)
    states = [h.report.state for h in log.reports]
    assert any(a == "Run" and b == "Hold" for a, b in pairwise(states))
    link.command(f"G21G90G94G1X{x:.3f}Y{y:.3f}F1200")
    link.port.close()
