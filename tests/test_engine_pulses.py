"""Pulses of force: the law, its edges in a residual, and the train that they make up."""

from dataclasses import replace

import numpy as np
import pytest

from corexy_fmi.effects import catalogue
from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.given import make_runs
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.naming.edges import Edge, edges
from corexy_fmi.engine.naming.pulses import train
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.kernel.reference_run import run_reference
from corexy_fmi.machine import EffectUse
from corexy_fmi.machine.check import machine_from
from corexy_fmi.recording import Recording
from corexy_fmi.simulate import excitation, machine_vector, simulate
from tests.contract.documents import problems

ROW, NOISE = 1e-3, 2e-7
LOOP = {"controller": "pd kp=20000.0 kd=200.0 rate_weight=0.0", "motors": "1", "zero": "x"}
PULSES = {"amplitude": 40.0, "frequency": 1.25, "phase": 0.7, "duty": 0.3}


def machine(*effects, **parameters):
    numbers = {"moving_mass": 50.0, "viscous_friction": 100.0, "coulomb_friction": 8.0}
    numbers |= {"force_gain": {"value": 30.0, "rel_std": 0.0}} | parameters
    text = {"machine": {"topology": "single_axis", "name": "axis"}, "parameters": numbers}
    return replace(machine_from(text, "test", "axis"), effects=effects)


def recorded(*effects, seconds=8.0, **parameters):
    """A run in closed loop, measured with a little noise."""
    time = ROW * np.arange(int(seconds / ROW))
    path = 0.03 * np.sin(1.7 * time) ** 3 + 0.01 * np.sin(4.1 * time)
    order = Recording("run.csv", time, {"phi1": path}, LOOP)
    x = simulate(machine(*effects, **parameters), order)["x"]
    x = x + NOISE * np.random.default_rng(3).standard_normal(len(time))
    return replace(order, channels={**order.channels, "x": x})


@pytest.fixture(scope="module")
def pulsed():
    return recorded(EffectUse("periodic_disturbance", "x", PULSES), moving_mass=53.0)


def base(recording):
    runs, _ = make_runs([recording], [recording], machine())
    return retune(bundled_layout(), machine(), tuple(runs))


@pytest.mark.parametrize("duty", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("frequency", [3.0, 97.3])
def test_pulses_give_their_momentum_whatever_the_step(duty, frequency):
    """Edges within a micro-step count by their part of it."""
    use = EffectUse(
        "periodic_disturbance",
        "x",
        {"amplitude": 5.0, "frequency": frequency, "phase": 0.4, "duty": duty},
    )
    free = machine(use, viscous_friction=0.0, coulomb_friction=0.0)
    time = ROW * np.arange(1501)
    v = simulate(free, Recording("r", time, {"V1": 0 * time}))["vx"]
    fine = np.arange(0, time[-1], 1e-6) + 5e-7
    on = np.mod(frequency * fine + 0.4 / (2 * np.pi), 1) < duty
    assert v[-1] == pytest.approx(5.0 / 50.0 * 1e-6 * on.sum(), rel=1e-4)


@pytest.mark.parametrize("duty", [0.0, 0.3])
def test_reference_and_kernel_agree(duty):
    values = PULSES | {"duty": duty, "frequency": 31.0}
    chosen = machine(EffectUse("periodic_disturbance", "x", values))
    time = ROW * np.arange(100)
    drive = excitation(chosen, Recording("r", time, {"V1": 0 * time}))
    slow = run_reference(
        bundled_layout(), drive, machine_vector(chosen), fidelity="single_axis", dc=True, limit=1e-4
    )
    fast = simulate(chosen, Recording("r", time, {"V1": 0 * time}))["x"]
    assert np.ptp(fast) > 1e-5
    assert np.abs(fast - slow["x"]).max() < 1e-12


def test_without_duty_it_is_a_sine():
    law = catalogue()["periodic_disturbance"].laws[0].function
    given = {"now": 0.3, "step": 1e-4, "amplitude": 2.0, "frequency": 3.0, "phase": 0.5}
    found = law(applied_force=1.0, duty=0.0, **given)["applied_force"]
    assert found == pytest.approx(1 + 2 * np.sin(2 * np.pi * 0.9 + 0.5), rel=1e-14)


def regular(count, period=0.8, width=0.3, size=5.0, first=0.4):
    return [
        Edge(first + period * n + late, sign * size)
        for n in range(count)
        for late, sign in ((0.0, 1), (width, -1))
    ]


def test_a_train_is_read_off_its_edges_even_if_some_are_lost():
    found = regular(9)
    del found[7], found[10]
    seen = train(found)
    assert (seen.frequency, seen.begin) == (pytest.approx(1.25), pytest.approx(0.4))
    assert (seen.duty, seen.size) == (pytest.approx(0.375), pytest.approx(5.0))
    assert np.sin(2 * np.pi * 1.25 * 0.4 + seen.phase) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    "found",
    [
        [],
        regular(2),
        [Edge(t, (-1) ** n * 5.0) for n, t in enumerate(np.cumsum(0.1 + np.arange(20) % 7))],
        [Edge(float(n), 5.0) for n in range(20)],
        [
            Edge(t, s * 4.0 ** (n // 2 % 5))
            for n, (t, s) in enumerate((e.time, e.size) for e in regular(9))
        ],
    ],
)
def test_no_train_where_edges_are_few_or_irregular(found):
    assert train(found) is None


def test_edges_are_found_where_the_force_jumps_and_nowhere_else(pulsed):
    turns = (np.arange(12) - PULSES["phase"] / (2 * np.pi)) / PULSES["frequency"]
    up = turns[(turns > 0.2) & (turns < 7.8)]
    found = edges(base(pulsed), 0, "x")
    risen = np.array([e.time for e in found if e.size > 0])
    assert all(np.abs(risen - t).min() < 3 * ROW for t in up)
    assert np.median([abs(e.size) for e in found]) == pytest.approx(40.0, rel=0.2)  # a start
    down = (np.arange(12) + PULSES["duty"] - PULSES["phase"] / (2 * np.pi)) / PULSES["frequency"]
    true = np.r_[turns, down]
    assert all(np.abs(true - e.time).min() < 5 * ROW for e in found)
    assert edges(base(recorded(moving_mass=53.0)), 0, "x") == []


def test_a_diagnosis_names_the_pulses(pulsed):
    document = diagnose([pulsed], [], machine()).document | {"seconds": 0.0}
    assert problems(document) == []
    assert document["verdict"] == "explained"
    assert [(e["name"], e["location"]) for e in document["effects"]] == [
        ("periodic_disturbance", "x")
    ]
    found = document["effects"][0]["parameters"]
    assert found["amplitude"]["value"] == pytest.approx(40.0, rel=0.02)
    assert found["duty"]["value"] == pytest.approx(0.3, abs=2e-3)
    assert found["frequency"]["value"] == pytest.approx(1.25, rel=1e-3)
    assert document["retuned"]["moving_mass"]["value"] == pytest.approx(53.0, rel=0.02)


@pytest.mark.parametrize("zero", ["x", ""])
def test_a_constant_force_shows_only_where_the_sensor_has_no_offset(zero):
    run = recorded(EffectUse("constant_force", "x", {"force": 3.0}), seconds=3.0)
    run = replace(run, metadata={**run.metadata, "zero": zero})
    fit = base(run)
    white = fit.problem.residual(fit.u[None])[0][: len(run.time)]
    offset = float(np.mean(fit.problem.errors(fit.u[None], 0)[0]))
    if zero:
        assert abs(np.mean(white)) > 0.05
        assert offset > 1e-6
    else:
        assert abs(np.mean(white)) < 1e-9
