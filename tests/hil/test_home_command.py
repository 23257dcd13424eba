"""`corexy hil home` and `--home` on the emulated board: dry first, then armed, then told."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from corexy_fmi.cli import app
from corexy_fmi.commands import hil_home
from corexy_fmi.commands.hil_home import home_board
from corexy_fmi.commands.hil_run import STOPPED, Setup, drive_on
from corexy_fmi.errors import InputError
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.homing import Switches
from corexy_fmi.motion import command
from corexy_fmi.rectangle import Rectangle
from tests.hil.kit import wait
from tests.hil.rig import Rig, Stage, yin
from tests.hil.test_homing import Switched

AT = Switches(x=-0.0025, y=-0.0025)


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    with Rig(Stage()) as made:
        monkeypatch.setattr(hil_home, "open_bench", lambda setup: (Board(made), None))
        yield made


@pytest.fixture
def setup(tmp_path: Path) -> Setup:
    out = tmp_path / "run.csv"
    return Setup(machine=yin(), port="rig", out=out, arm=True, home=True, switches=AT)


def test_home_is_dry_by_default() -> None:
    done = CliRunner().invoke(app, ["hil", "home", "--port", "nowhere"])
    assert done.exit_code == 0
    assert "nothing moves: first x towards -x, at most 0.198 m" in done.output
    assert "--arm" in done.output


def test_a_grbl_controller_knows_its_own_switches() -> None:
    words = ["hil", "home", "--port", "nowhere", "--dialect", "grbl", "--at-x", "-0.08"]
    done = CliRunner().invoke(app, words)
    assert isinstance(done.exception, InputError)
    assert "--at-x" in str(done.exception)


def test_home_tells_where_it_stands(
    rig: Rig, setup: Setup, capsys: pytest.CaptureFixture[str]
) -> None:
    Switched(rig, (-0.0025, -0.0025))
    home_board(setup)
    assert "homed; the carriage is at x = 0.00" in capsys.readouterr().out


def test_homing_that_fails_ends_with_what_to_do(
    rig: Rig, setup: Setup, capsys: pytest.CaptureFixture[str]
) -> None:
    rig.events.append((0.5, lambda: rig.emulator.pin("C0", 1)))
    with pytest.raises(typer.Exit) as left:
        home_board(setup)
    assert left.value.exit_code == STOPPED
    assert "emergency stop pressed; release it" in capsys.readouterr().err


def test_a_run_may_begin_with_homing(rig: Rig, setup: Setup) -> None:
    Switched(rig, (-0.0025, -0.0025))
    order = command(Rectangle(0.002, 0.002, 0.039).motion, 5e-3)
    made = drive_on(setup, Board(rig), order, None)
    assert made is not None
    assert made.metadata["run"] == "complete"


def test_a_run_without_a_place_is_refused(rig: Rig, setup: Setup) -> None:
    order = command(Rectangle(0.002, 0.002, 0.039).motion, 5e-3)
    with pytest.raises(InputError, match="add --home, or move it to the centre"):
        drive_on(replace(setup, home=False), Board(rig), order, None)
    wait(Board(rig), 0.05)
    assert rig.counts == (0, 0)
