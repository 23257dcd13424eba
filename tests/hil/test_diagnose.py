"""The product's loop: an effect concealed in the plant is named from what the board recorded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from corexy_fmi.commands.hil_diagnose import commission, result_files
from corexy_fmi.commands.hil_run import Setup
from corexy_fmi.hil.board import Board
from corexy_fmi.hil.limits import Allowed
from corexy_fmi.hil.tracker import Tracker
from corexy_fmi.machine import EffectUse, load_machine
from tests.hil.rig import Rig, RigLines, Stage, yin

GAP = 0.03  # [rad]
NOISE = 2e-5  # [m] of the tracker


def test_concealed_backlash_is_named(tmp_path: Path) -> None:
    effect = EffectUse("backlash", "motor1", {"gap": GAP})
    out = tmp_path / "result"
    with Rig(Stage(replace(yin(), effects=(effect,))), tracker_rate=100.0) as rig:
        rig.noise = np.random.default_rng(0), NOISE
        setup = Setup(yin(), None, Allowed(), "rig", out, "rig", True, True, False, 24.0)
        document = commission(setup, Board(rig), Tracker(RigLines(rig)), jobs=1)
    assert document["verdict"] == "explained"
    (found,) = document["effects"]
    assert (found["name"], found["location"]) == ("backlash", "motor1")
    low, high = found["parameters"]["gap"]["ci95"]
    assert 0.9 * GAP < found["parameters"]["gap"]["value"] < 1.1 * GAP
    assert low < high
    assert all(path.is_file() for path in result_files(out))
    assert load_machine(out / "machine.toml").effects[0].name == "backlash"
