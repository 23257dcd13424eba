"""The engine on stages other than Core-XY: what was planted is named, and a null is left alone."""

from dataclasses import replace

import engine_kit
import numpy as np
import pytest
from engine_kit import NOISE, named, other_motion, rich_motion

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.restart import begun, best
from corexy_fmi.machine import EffectUse
from corexy_fmi.machine.check import machine_from
from corexy_fmi.motion import row_times
from corexy_fmi.recording import Recording
from corexy_fmi.simulate import simulate
from corexy_fmi.topology import STAGES

PLANAR = {
    "pulley_radius": 5e-3, "carriage_mass": 0.2, "bridge_mass": 0.5, "motor_inertia": 1e-5,
    "belt_axial_stiffness": 9000.0, "bridge_pulley_spacing": 0.3, "motor_idler_span": 0.4,
    "carriage_viscous_friction": 1.0, "bridge_viscous_friction": 2.0,
    "carriage_coulomb_friction": 0.5, "bridge_coulomb_friction": 1.0,
}  # fmt: skip
PARAMETERS = {"cartesian": PLANAR, "h_frame": PLANAR | {"clip_spacing": 0.06}}
STRIBECK = EffectUse("stribeck_friction", "y", {"static_ratio": 1.5, "speed": 0.02})
DELAY = EffectUse("sensor_delay", "sensor", {"delay": 0.004})


def machine(topology):
    """A stage with friction, driven by steppers."""
    head = {"topology": topology, "name": topology, "drive": "stepper"}
    return machine_from({"machine": head, "parameters": PARAMETERS[topology]}, "test", topology)


def recorded(chosen, truth, motion, seed):
    """A noisy recording of a motion at 1 kHz."""
    time = row_times(motion, 1000.0)
    stage = STAGES[chosen.stage]
    angles = np.linalg.solve(stage.rest, motion.position(time).T) / PLANAR["pulley_radius"]
    order = Recording(f"{seed}.csv", time, dict(zip(("phi1", "phi2"), angles, strict=True)))
    response, random = simulate(truth, order), np.random.default_rng(seed)
    measured = {n: response[n] + NOISE * random.normal(size=len(time)) for n in ("x", "y")}
    return replace(order, channels=order.channels | measured)


@pytest.mark.long
@pytest.mark.parametrize(
    ("topology", "uses"),
    [("cartesian", (DELAY,)), ("h_frame", (STRIBECK,)), *((t, ()) for t in PARAMETERS)],
    ids=["cartesian-delay", "h_frame-friction", *(f"{t}-null" for t in PARAMETERS)],
)
def test_what_is_planted_is_named(topology, uses):
    chosen = machine(topology)
    numbers = chosen.parameters | {"carriage_mass": 0.22, "belt_axial_stiffness": 8500.0}
    truth = replace(chosen, parameters=numbers, effects=uses)
    train, judge = (
        recorded(chosen, truth, m(), n) for n, m in ((1, rich_motion), (2, other_motion))
    )
    document = diagnose([train], [judge], chosen, jobs=1).document
    assert document["verdict"] == ("explained" if uses else "nothing_missing")
    assert named(document) == {(use.name, use.location) for use in uses}


@pytest.mark.parametrize("topology", list(PARAMETERS))
def test_retuning_finds_the_frequency(topology):
    """A lightly damped stage whose mass is off by a tenth rings out of step after a few swings."""
    chosen = machine(topology)
    truth = replace(chosen, parameters=chosen.parameters | {"carriage_mass": 0.22})
    recording = recorded(chosen, truth, rich_motion(), 1)
    problem = engine_kit.problem(recording, chosen)
    near = np.zeros(problem.size)
    mass = [x.key for x in problem.unknowns].index("carriage_mass")
    near[mass] = problem.unknowns[mass].internal(0.22)
    known = minimise(problem, near, 15)
    found = minimise(problem, best(begun(problem, np.zeros(problem.size))).u, 15)
    assert found.cost < known.cost + 5
