"""The plant's own effects, each against what its sentence in the contract says."""

import hashlib
import json
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import plant
from plant import bends, force, kernel, solver
from plant.effects import BY_NAME
from plant.evidence import whitened_run
from plant.machines import base, free_names, pack
from plant.motions import STEP
from plant.planted import Planted
from plant.recording import Run, channels
from plant.scale import clean
from scipy.optimize import least_squares

SECONDS, TURN, GAP = 2.0, 1.5, 0.1
IDLERS = [f"pulley{i}" for i in range(3, 11)]


def run_of(motor1, motor2):
    ref = np.column_stack([motor1, motor2])
    return Run(ref, (0.0, 0.0), 0.0, np.zeros_like(ref), 1)


def seen(drive, run, slots=None):
    values = base("yin2018", drive)
    return channels(pack(values, drive, {"smooth_speed": 0.0} | (slots or {})), run)


def there_and_back(motor):
    """One motor slowly up and down, twice; the other one still."""
    t = np.arange(0.0, 2 * SECONDS, STEP)
    turning = TURN * np.sin(2 * np.pi * t / SECONDS)
    return t, run_of(*((turning, 0 * t) if motor == "motor1" else (0 * t, turning)))


def lost_motion(out, t, motor):
    """Belt travel rising less falling, at the middle of the second round [m]."""
    travel = out["x"] + (1.0 if motor == "motor1" else -1.0) * out["y"]
    falling, rising = np.interp([1.5 * SECONDS, 2.0 * SECONDS - STEP], t, travel)
    return falling - rising


@pytest.mark.parametrize("motor", ["motor1", "motor2"])
@pytest.mark.parametrize(
    "form", [{"form": 0.0, "hold": 0.0}, {"form": 0.0, "hold": 5e-4}, {"form": 1.0}]
)
def test_backlash_loses_its_gap_at_each_reversal(form, motor):
    t, run = there_and_back(motor)
    slots = BY_NAME["backlash"].slots(motor, {"gap": GAP}, form)
    lost = lost_motion(seen("stepper", run, slots), t, motor) - lost_motion(
        seen("stepper", run), t, motor
    )
    assert lost == pytest.approx(GAP * base("yin2018", "stepper")["pulley_radius"], rel=0.1)


def test_play_follows_the_hysteresis_operator():
    t, run = there_and_back("motor1")
    slots = BY_NAME["backlash"].slots("motor1", {"gap": GAP}, {"form": 1.0})
    belt_side, way = 0.0, []
    for phi in run.ref[:, 0]:
        belt_side = min(max(belt_side, phi - GAP / 2), phi + GAP / 2)
        way.append(belt_side)
    with_play = seen("stepper", run, slots)
    without = seen("stepper", run_of(way, 0 * t))
    for axis in "xy":
        assert with_play[axis] == pytest.approx(without[axis], abs=2e-6)


@pytest.mark.parametrize("drive", ["stepper", "dc"])
@pytest.mark.parametrize("pulley", IDLERS)
def test_eccentric_idlers_move_the_stage(pulley, drive):
    t = np.arange(0.0, SECONDS, STEP)
    run = run_of(4.0 * np.sin(np.pi * t / SECONDS) ** 2, 2.0 * np.sin(2 * np.pi * t / SECONDS))
    slots = BY_NAME["pulley_eccentricity"].slots(pulley, {"amplitude": 1e-4, "phase": 0.5}, {})
    out, plain = seen(drive, run, slots), seen(drive, run)
    moved = max(np.abs(out[axis] - plain[axis]).max() for axis in "xy")
    assert 5e-6 < moved < 4e-4


@pytest.mark.parametrize(("pulley", "turns"), [(7, False), (8, True), (9, True), (10, False)])
def test_run_out_sits_at_the_idler_that_was_named(pulley, turns):
    """Motor 1 alone turns 8 and 9, and only them among the fixed idlers."""
    _, run = there_and_back("motor1")
    phased = {"amplitude": 2e-4, "phase": 0.5}
    slots = BY_NAME["pulley_eccentricity"].slots(f"pulley{pulley}", phased, {})
    moved = np.abs(seen("stepper", run, slots)["x"] - seen("stepper", run)["x"]).max()
    assert (moved > 1e-5) == turns
    assert (moved < 2e-6) != turns


def test_compiled_code_belongs_to_these_sources():
    """Compiled code of a file holds slots of layout.py, and may not outlive a change there."""
    here = Path(plant.__file__).parent
    read = sorted(set(here.glob("*.py")) - {here / name for name in plant.TABLES})
    assert not any("njit" in (here / name).read_text() for name in plant.TABLES)
    sources = b"".join(p.read_bytes() for p in read)
    wanted = hashlib.sha256(sources).hexdigest()[:12]
    for compiled in (bends.belt, kernel.accelerate, solver.simulate, force.stage_forces):
        assert wanted in Path(compiled.stats.cache_path).parts


def least_distance(world, planted, values):
    """Squared distance that another optimiser leaves, over all free parameters, scale and all."""
    names, runs, noise = free_names(world.drive), world.runs[:2], world.masks[:2]
    n = len(names)

    def output(shown):
        return np.concatenate([whitened_run(*one) for one in zip(shown, noise, strict=True)])

    truth = output(clean(world, planted))

    def away(p):
        logs = dict(zip(names, p, strict=False))
        tried = {k: v * np.exp(logs.get(k, 0.0)) for k, v in world.values.items()}
        w, bends = pack(tried, world.drive), p[n:].reshape(-1, 2) * 1e-5
        shown = [channels(w, run, bend) for run, bend in zip(runs, bends, strict=True)]
        return np.concatenate([output(shown) - truth, 0.05 * p])

    first = [np.log(values[name] / world.values[name]) for name in names]
    first = np.append(first, 1e5 * np.array([run.deflection for run in runs]))
    found = least_squares(
        away, first, bounds=(-6.0, 6.0), x_scale="jac", diff_step=3e-3, max_nfev=20, ftol=1e-3
    )
    return float(np.sum(found.fun[: len(truth)] ** 2))


@pytest.mark.parametrize(
    ("effect", "location", "setting", "machine"),
    [
        ("sensor_delay", "sensor", "dc", "light_bench"),
        ("stepper_compliance", "motors", "commissioning", "light_bench"),
        ("axis_skew", "sensor", "commissioning", "gt2_printer"),
    ],
)
@pytest.mark.long
def test_no_other_optimiser_finds_a_nearer_nominal_machine(effect, location, setting, machine):
    case = plant.draw(7, "effect", effect, location, setting, 1000.0, machine=machine)
    planted = replanted(case)
    assert case.truth["E"] < 1.1 * least_distance(case.world, planted, case.world.values) + 1.0


def replanted(case):
    """The planted effect of a case, from its truth."""
    (said,) = case.truth["effects"]
    entry, shape = BY_NAME[said["name"]], dict(said["parameters"])
    size = shape.pop(entry.size_name)
    if said["name"] in ("stribeck_friction", "stepper_compliance"):
        size = size - 1.0 if said["name"] == "stribeck_friction" else 1.0 / size
    return (Planted(entry, said["location"], size, shape, said["form"]),)


DRAWN = [
    ("pair", None, "rectangles", "gt2_printer"),
    ("null", None, "dc", "light_bench"),
    ("outside", "gusts", "commissioning", "yin2018"),
    ("effect", "constant_force", "dc", "gt2_printer"),
]


@pytest.mark.parametrize(("kind", "effect", "setting", "machine"), DRAWN)
@pytest.mark.long
def test_a_draw_is_repeatable_sealed_and_has_a_twin(kind, effect, setting, machine):
    case, again = (
        plant.draw(11, kind, effect, setting=setting, machine=machine, target_E=300.0)
        for _ in range(2)
    )
    assert (case.truth, case.train, case.holdout) == (again.truth, again.train, again.holdout)
    assert case.machine_toml == again.machine_toml
    digest, sealed = plant.seal(case)
    assert hashlib.sha256(sealed).hexdigest() == digest
    assert json.loads(sealed[32:]) == json.loads(json.dumps(case.truth))
    assert 0.0 <= case.truth["E_sep"] <= case.truth["E"]
    assert len(case.truth["effects"]) == {"pair": 2, "null": 0}.get(kind, 1)
    twin = plant.twin(case)
    assert twin.truth["effects"] == []
    assert twin.machine_toml == case.machine_toml
    assert twin.planted_force is None
    if case.truth["noise"]["jitter"] == 0.0:
        noises = []
        for one in (case, twin):
            lines = [n for n in one.train["train1.csv"].splitlines() if n[0] != "#"]
            table = np.genfromtxt(lines, delimiter=",", names=True)
            noises.append(table["x"] - one.train_clean["train1.csv"]["x"])
        np.testing.assert_allclose(noises[0], noises[1], atol=1e-12)
    if effect == "constant_force":
        forces = np.concatenate(case.planted_force["force"])
        size = case.truth["effects"][0]["parameters"]["force"]
        axis = "xy".index(case.truth["effects"][0]["location"])
        assert np.median(forces[:, axis]) == pytest.approx(size)
        assert np.median(forces[:, 1 - axis]) == 0.0
