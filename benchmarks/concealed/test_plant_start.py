"""How the plant's runs begin: in balance, with or without a known zero; no rotor slips; and one
more run of a concealed machine on another motion."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import plant
from plant.evidence import whiten
from plant.machines import base, pack
from plant.motions import STEP
from plant.recording import Run, channels
from plant.scale import clean, slips
from plant.world import choose, draw_world

KE = 4795.0  # section stiffness of yin2018 from a motor to the end-effector, PHYSICS 4 [N/m]
FORCE = 1.5  # [N]
FRICTIONS = ("carriage", "bridge", "pulley")


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("drive", ["stepper", "dc"])
@pytest.mark.parametrize("spring", [0.0, 0.3])
def test_a_constant_force_was_there_before_the_recording(drive, axis, spring):
    values = base("yin2018", drive) | {f"{n}_coulomb_friction": 0.0 for n in FRICTIONS}
    own = {"holding_torque": spring, "magnetic_damping": 1e-3} if drive == "stepper" else {}
    ref = np.zeros((round(0.3 / STEP), 2))
    run = Run(ref, (0.0, 0.0), 0.0, np.zeros_like(ref), 1)
    shown = channels(pack(values, drive, {f"force_{axis}": FORCE} | own), run)
    assert np.ptp(shown[axis]) < 1e-9
    if drive == "stepper" and not spring:
        assert shown[axis][0] == pytest.approx(FORCE / (2 * KE), rel=1e-3)
    else:
        assert shown[axis][0] > 1.005 * FORCE / (2 * KE)
    assert np.abs(shown["y" if axis == "x" else "x"]).max() < 1e-9


@pytest.mark.long
def test_only_a_known_zero_tells_of_a_constant_force():
    """With free offsets the force leaves nothing; with the inputs' zero it is seen."""
    options = {
        "effect": "constant_force",
        "location": "x",
        "setting": "rectangles",
        "machine": "yin2018",
    }
    free = plant.draw(5, **options, target_E=1000.0)
    assert free.truth["E"] < 1.0
    known = plant.draw(5, **options, target_E=1000.0, catalogue="full")
    assert known.truth["E"] == pytest.approx(1000.0, rel=0.15)
    assert all(text.startswith("# zero: x, y\n") for text in (known.train | known.holdout).values())
    assert not any("# zero" in text for text in (free.train | free.holdout).values())


def test_some_recordings_without_a_force_have_a_zero_too():
    worlds = [draw_world(s, "rectangles", None, None, "null", "full") for s in range(40)]
    assert 2 <= sum(w.zeroed for w in worlds) <= 16
    assert not any(draw_world(s, None, None, None, "null", "ten").zeroed for s in range(10))


def test_whitening_keeps_the_offset_of_a_zeroed_channel():
    ones, taken = np.ones(100), np.ones(100, bool)
    assert np.abs(whiten(ones, 0.5, 0.0, taken)).max() < 1e-12
    assert whiten(ones, 0.5, 0.0, taken, True) == pytest.approx(2.0 * ones)


def test_a_weak_magnet_slips_and_a_strong_one_does_not():
    world = draw_world(3004714532, "commissioning", None, {"rho": 0.0}, "effect", "full")
    (one,) = choose(3004714532, world, "effect", "stepper_compliance", None)
    strong, weak = one.scaled(1 / (0.3 * one.size)), one.scaled(1 / (0.0553 * one.size))
    assert not slips(world, (strong,))
    assert slips(world, (weak,))
    assert clean(world, (strong,))[0]["x"].shape == clean(world, (weak,))[0]["x"].shape


@pytest.mark.long
def test_one_more_run_shows_the_same_machine_elsewhere():
    case = plant.draw(
        5, effect="tool_mode", setting="commissioning", target_E=1000.0, catalogue="full"
    )
    ref = case.world.runs[2].ref[:2000]
    texts = [plant.perform(case, ref, n) for n in (0, 0, 1)]
    assert texts[0] == texts[1] != texts[2]
    head, *rows = [line for line in texts[0].splitlines() if not line.startswith("#")]
    assert head.startswith("time,phi1,phi2,x,y")
    kept = sorted(_times(rows))
    shown = np.array([row.split(",")[1:3] for row in rows], float)
    assert shown == pytest.approx(ref[kept], abs=1e-2)
    assert np.array([r.split(",")[3] or "nan" for r in rows], float)[0] == pytest.approx(
        case.holdout_clean["holdout1.csv"]["x"][0], abs=3e-4
    )


def _times(rows):
    return {round(1e3 * float(row.split(",")[0])) for row in rows}
