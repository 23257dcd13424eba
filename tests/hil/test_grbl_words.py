"""What the adapter reads: banners, options, settings, reports, codes; and the moves it makes."""

from __future__ import annotations

import numpy as np
import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.hil import grbl_words
from corexy_fmi.hil.grbl_limits import travel
from corexy_fmi.hil.grbl_moves import LONGEST, SHORT, Grid, Move, moves, program, straight
from corexy_fmi.hil.grbl_report import Build, Family, Report, build, report, settings
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle
from tests.hil.grbl_kit import RADIUS, order_of

GRID = Grid(101.859, (0, 0))


@pytest.mark.parametrize(
    ("lines", "family", "factor", "corexy", "buffer", "blocks"),
    [
        (["Grbl 1.1h ['$' for help]", "[VER:1.1h.20190830:]", "[OPT:VC,15,128]"],
         Family.GRBL, 2**0.5, True, 128, 15),
        (["[VER:1.1f.20170801:mine]", "[OPT:V,15,128]"], Family.GRBL, 2**0.5, False, 128, 15),
        (["GrblHAL 1.1f ['$' or '$HELP' for help]", "[VER:1.1f.20261004:]",
          "[OPT:VNMSL,35,1024,3,0]", "[FIRMWARE:grblHAL]", "[KINEMATICS:CoreXY v2.02]"],
         Family.GRBLHAL, 1.0, True, 1024, 35),
        (["GrblHAL 1.1f ['$' or '$HELP' for help]", "[VER:1.1f.20261004:]", "[OPT:VNMSL,35,1024]"],
         Family.GRBLHAL, 1.0, None, 1024, 35),
        (["Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]", "[VER:3.7 FluidNC v3.7.8:]",
          "[OPT:MPHSEW]"], Family.FLUIDNC, 1.0, None, 128, 15),
    ],
)  # fmt: skip
def test_who_it_is(
    lines: list[str], family: Family, factor: float, corexy: bool | None, buffer: int, blocks: int
) -> None:
    made = build(lines)
    assert (made.family, made.corexy, made.buffer, made.blocks) == (family, corexy, buffer, blocks)
    assert made.feed_factor == pytest.approx(factor)


@pytest.mark.parametrize(
    ("lines", "words"),
    [(["hello"], "no .VER:."), (["[VER:0.9j.2016:]"], "GRBL 0.9j.2016, expected 1.1")],
)
def test_strangers(lines: list[str], words: str) -> None:
    with pytest.raises(InputError, match=words):
        build(lines)


def test_settings() -> None:
    assert settings(["$0=30", "$100=101.859", "ok", "$N0=G54", "[MSG:x]"]) == {
        0: 30.0,
        100: 101.859,
    }


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("<Idle|MPos:0.000,-1.500,0.000|Bf:15,128|FS:0,0|WCO:1.000,2.000,0.000>",
         Report("Idle", None, (0.0, -1.5), None, (1.0, 2.0), "", 0.0, (15, 128))),
        ("<Hold:0|WPos:3.0,4.0,0.0|F:250|Pn:XP>",
         Report("Hold", 0, None, (3.0, 4.0), None, "XP", 250.0)),
        ("<Run|MPos:1,2|Ov:100,100,100|A:S>", Report("Run", None, (1.0, 2.0), None, None)),
        ("<Door:2|MPos:1,2,3,4>", Report("Door", 2, (1.0, 2.0), None, None)),
        ("<Run|MPos:1.x,2>", None),
        ("<Run|MPos:1>", None),
        ("[MSG:Check Door]", None),
        ("ok", None),
    ],
)  # fmt: skip
def test_reports(line: str, expected: Report | None) -> None:
    assert report(line) == expected


def test_inches_and_work_positions() -> None:
    inches = report("<Idle|MPos:1.000,2.000>", 25.4)
    assert inches is not None
    assert inches.machine == pytest.approx((25.4, 50.8))
    work = report("<Idle|WPos:1.0,2.0>")
    assert work is not None
    assert work.place(None) is None
    assert work.place((10.0, 20.0)) == (11.0, 22.0)


def test_codes_have_words() -> None:
    assert "soft limit" in grbl_words.alarm(2)
    assert "no feed rate" in grbl_words.error(22)
    assert grbl_words.alarm(99) == "ALARM:99 (unknown to this version)"
    assert set(grbl_words.ALARMS) == set(range(1, 10))
    assert set(grbl_words.ERRORS) == {*range(1, 18), *range(20, 39)}
    assert {code for code in range(1, 19) if not grbl_words.lost(code)} == {2, 4, 5}


@pytest.mark.parametrize(
    ("family", "ten", "fourteen"),
    [(Family.GRBL, "dual axis", "unknown"), (Family.GRBLHAL, "emergency stop", "spindle"),
     (Family.FLUIDNC, "spindle", "not homed")],
)  # fmt: skip
def test_the_same_number_is_another_alarm_elsewhere(
    family: Family, ten: str, fourteen: str
) -> None:
    assert ten in grbl_words.alarm(10, family)
    assert fourteen in grbl_words.alarm(14, family)
    assert "soft limit" in grbl_words.alarm(2, family)
    assert "locked" in grbl_words.error(9, family)
    seventy_nine = "reset the controller" if family is Family.GRBLHAL else "unknown"
    assert seventy_nine in grbl_words.error(79, family)


@pytest.mark.parametrize(
    ("options", "mask", "low", "high"),
    [("C", 0, (-160, -120), (0, 0)), ("C", 3, (-160, -120), (0, 0)),
     ("CZ", 3, (0, 0), (160, 120)), ("CZ", 1, (0, -120), (160, 0))],
)  # fmt: skip
def test_travel(options: str, mask: int, low: tuple, high: tuple) -> None:
    build = Build(Family.GRBL, "1.1h", options)
    found = travel({130: 160, 131: 120, 23: mask}, build)
    assert (tuple(found[0]), tuple(found[1])) == (low, high)


@pytest.mark.parametrize("acceleration", [None, 1.0])
def test_moves_keep_corners_and_time(acceleration: float | None) -> None:
    shape = Rectangle(0.02, 0.014, 0.039, 2, acceleration)
    order = order_of(shape)
    start, made = moves(order, RADIUS, GRID)
    assert sum(move.seconds for move in made) == pytest.approx(order.time[-1])
    corners = {tuple(np.rint(v * 1e3 * GRID.per_mm).astype(int)) for v in shape.vertices}
    places = np.array([start, *((move.x, move.y) for move in made)])
    assert all(np.abs(places - corner).max(axis=1).min() <= 1 for corner in corners)
    assert made[-1].seconds == pytest.approx(0.5, abs=SHORT)
    short = sum(move.seconds < 0.9 * SHORT for move in made)
    assert short <= len(shape.vertices)  # one at a corner


def test_a_turn_back_is_a_corner() -> None:
    time = np.arange(0, 0.04, 1e-3)
    phi = np.abs(time - 0.02)
    order = Recording("o", time, {"phi1": phi, "phi2": phi})
    _, made = moves(order, RADIUS, GRID)
    assert 0 in {move.x for move in made}


def test_slow_motions_are_no_rests() -> None:
    time = np.arange(0, 10, 1e-3)
    order = Recording("o", time, {"phi1": 1e-2 * time, "phi2": 1e-2 * time})  # a step in 0.2 s
    _, made = moves(order, RADIUS, GRID)
    assert made[-1].x == round(5 * 0.0999 * 101.859)


def test_program_feeds_keep_the_time() -> None:
    made = [Move(0.5, 1019, 0), Move(0.25, 1019, 0), Move(1.0, 0, 1019)]
    lines = program((0, 0), made, GRID, (1.0, -2.0), 2**0.5)
    assert lines[0] == "G1X9.0040Y2.0000F1697.74"  # 10.004 mm in 0.5 s, times sqrt(2)
    assert lines[1] == "G4P0.250"
    assert float(lines[2].split("F")[1]) == pytest.approx(60 * 14.1479 * 2**0.5, rel=1e-3)


def test_the_way_to_the_start_is_in_short_moves() -> None:
    made = straight((0, 0), (3000, -2000), 0.02, GRID)
    assert made[-1][1:] == (3000, -2000)
    assert max(move.seconds for move in made) <= LONGEST
    way = np.hypot(3000, 2000) / GRID.per_mm / 1e3
    assert sum(move.seconds for move in made) == pytest.approx(way / 0.02)
    assert straight((5, 5), (5, 5), 0.02, GRID) == []
