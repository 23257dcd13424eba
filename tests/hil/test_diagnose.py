"""The product's loop: an effect concealed in the plant is named from what the board recorded."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from corexy_fmi.commands import hil_diagnose
from corexy_fmi.commands.hil_diagnose import HOLDOUT, TRAIN, commission, result_files
from corexy_fmi.commands.hil_run import Setup
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.tracker import Tracker
from corexy_fmi.machine import EffectUse, Machine, load_machine
from corexy_fmi.motion import chain, line, rest
from corexy_fmi.programs import named_command
from corexy_fmi.recording import Recording, read_recording, write_recording
from corexy_fmi.rectangle import Rectangle
from tests.hil.commissioning import Concealed, commissioned
from tests.hil.rig import Rig, RigLines, Stage, yin

GAP = 0.03  # [rad]
SMALL = {TRAIN: Rectangle(0.004, 0.003, 0.05, 1, 1.0), HOLDOUT: Rectangle(0.003, 0.003, 0.05)}
NOISE, SEED = 1e-5, 1  # [m] of the tracker; docs/hil.md tells what other seeds gave


@pytest.mark.long
def test_concealed_backlash_is_named(tmp_path: Path) -> None:
    out = tmp_path / "result"
    effect = EffectUse("backlash", "motor1", {"gap": GAP})
    document = commissioned(Concealed(effect, NOISE, SEED), out, 1)
    assert document["verdict"] == "explained"
    (found,) = document["effects"]
    assert (found["name"], found["location"]) == ("backlash", "motor1")
    low, high = found["parameters"]["gap"]["ci95"]
    assert 0.9 * GAP < found["parameters"]["gap"]["value"] < 1.1 * GAP
    assert low < high
    assert all(path.is_file() for path in result_files(out))
    assert load_machine(out / "machine.toml").effects[0].name == "backlash"
    assert not (out / "experiment1.csv").exists()


class Oracle:
    """In place of the engine: proposes a stroke so many ``times``, and remembers."""

    def __init__(self, times: int, reach: float = 0.002, kept_back: bool = False) -> None:
        self.times, self.reach, self.kept_back = times, reach, kept_back
        self.seen: list[tuple[list[str], list[str]]] = []

    def __call__(
        self, folder: Path, trains: list[Recording], holdouts: list[Recording], machine: Machine,
        *others: Any,
    ) -> dict[str, Any]:  # fmt: skip
        self.seen.append(([r.name for r in trains], [r.name for r in holdouts]))
        open_still = len(self.seen) <= self.times
        if open_still:
            ends = ((0.0, 0.0), (self.reach, 0.0))
            to, fro = (line(*way, 0.02, 0.5) for way in (ends, ends[::-1]))
            motion = chain(rest(ends[0], 0.2), to, fro, rest(ends[0], 0.2))
            write_recording(named_command("n.csv", motion, machine), folder / "next_experiment.csv")
        proposed = {"why": "the stroke parts them", "program": "next_experiment.csv",
                    "kept_back": self.kept_back}  # fmt: skip
        return {"verdict": "ambiguous" if open_still else "explained",
                "next_experiment": proposed if open_still else None}  # fmt: skip


@pytest.fixture
def rig() -> Iterator[Rig]:
    with Rig(Stage(), tracker_rate=100.0) as made:
        yield made


def commission_with(
    oracle: Oracle, rig: Rig, out: Path, monkeypatch: pytest.MonkeyPatch
) -> dict[str, Any]:
    monkeypatch.setattr(hil_diagnose, "write_diagnosis", oracle)
    monkeypatch.setattr(hil_diagnose, "shapes", lambda machine: SMALL)
    setup = Setup(machine=yin(), port="rig", out=out, tracker="rig", centred=True, arm=True)
    return commission(setup, Board(rig), Tracker(RigLines(rig)), 1, 1)


def test_what_is_proposed_is_driven_and_diagnosed_with_the_rest(
    rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    oracle = Oracle(1)
    document = commission_with(oracle, rig, tmp_path, monkeypatch)
    assert document["verdict"] == "explained"
    held = ["holdout.csv"]
    assert oracle.seen == [(["commissioning.csv"], held),
                           (["commissioning.csv", "experiment1.csv"], held)]  # fmt: skip
    made = read_recording(tmp_path / "experiment1.csv")
    assert made.metadata["run"] == "complete"
    assert max(made["phi1"]) == pytest.approx(0.002 / 5e-3, abs=1e-3)
    assert made.measured == ("x", "y")
    assert not (tmp_path / "next_experiment.csv").exists()  # it was of the first diagnosis


def test_what_is_to_judge_is_kept_back(
    rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    oracle = Oracle(1, kept_back=True)
    commission_with(oracle, rig, tmp_path, monkeypatch)
    assert oracle.seen[1] == (["commissioning.csv"], ["holdout.csv", "experiment1.csv"])


def test_a_verdict_that_stays_open_ends_all_the_same(
    rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    oracle = Oracle(9)
    document = commission_with(oracle, rig, tmp_path, monkeypatch)
    assert document["verdict"] == "ambiguous"
    assert len(oracle.seen) == 2
    assert (tmp_path / "next_experiment.csv").exists()


def test_a_proposal_beyond_the_limits_is_left_out(
    rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    oracle = Oracle(1, reach=0.5)
    document = commission_with(oracle, rig, tmp_path, monkeypatch)
    assert document["verdict"] == "ambiguous"
    assert "left out: motion at" in capsys.readouterr().out
    assert len(oracle.seen) == 1
