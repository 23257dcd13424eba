"""Derivatives of outputs: along time, and along inputs and parameters; against differences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fmu_kit import FMU2Told, diseased, folder, machine, slave, use

from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.machine import EffectUse

STATE = {"x_true": "vx", "y_true": "vy", "phi1_meas": "omega1", "phi2_meas": "omega2"}
FIRST = {"phi1": 3.0, "phi2": 1.0}
STEP = 2e-5  # [s]


def slopes(one: FMU2Told, *names: str) -> list[float]:
    """First derivatives of outputs."""
    references = [one.references[n] for n in names]
    return list(one.getRealOutputDerivatives(references, [1] * len(names)))


def moving(one: FMU2Told, until: float = 0.03) -> FMU2Told:
    """In motion with constant rates."""
    one.begin()
    one.slope(20.0, -8.0)
    one.doStep(0.0, until)
    return one


def test_the_derivative_of_a_place_is_its_velocity() -> None:
    """To the last bit where the state holds it; the sensor sees the truth here."""
    with slave() as one:
        moving(one)
        assert slopes(one, *STATE) == one.read(*STATE.values())
        assert slopes(one, "x", "y") == pytest.approx(one.read("vx", "vy"), rel=1e-3)


@pytest.mark.parametrize("inside", [False, True])
def test_derivatives_of_outputs_equal_differences(inside: bool) -> None:
    """Of a run that goes on: between its points before and after."""
    names = ("x", "y", "vx", "ax", "ay", "tension1", "tension7", "omega1", "torque1")
    fmu = build_fmu(folder() / "diseased", diseased()) if inside else None
    with slave(fmu) as one:
        moving(one)
        rows = []
        for n in range(12):
            one.doStep(0.03 + n * STEP, STEP)
            rows.append([one.read(*names), slopes(one, *names)])
        values, found = np.moveaxis(np.array(rows), 1, 0)
        central = (values[2:] - values[:-2]) / (2 * STEP)
        scale = np.abs(central).max(axis=0) + 1e-6
        assert (np.abs(found[1:-1] - central) / scale).max() < 0.05
        assert (np.abs(central).max(axis=0)[:6] > 1e-3).all()


def test_asking_for_derivatives_changes_nothing() -> None:
    """The run goes on with the same bits."""
    with slave() as one, slave() as other:
        for each in (one, other):
            moving(each)
        slopes(one, "x", "ax", "tension3")
        for each in (one, other):
            each.doStep(0.03, 0.01)
        assert one.read("x", "ax", "tension3") == other.read("x", "ax", "tension3")


def test_what_has_no_derivative_is_refused() -> None:
    """Inputs, other orders, a run that has not begun."""
    with slave() as one:
        x, phi = [one.references["x"]], [one.references["phi1"]]
        assert "instantiated" in one.refusal("getRealOutputDerivatives", x, [1])
        one.begin()
        assert "no output" in one.refusal("getRealOutputDerivatives", phi, [1])
        assert "order 1" in one.refusal("getRealOutputDerivatives", x, [2])
        assert "unknown" in one.refusal("getRealOutputDerivatives", [99999], [1])


def directional(one: FMU2Told, outputs: list[str], seeds: dict[str, float]) -> list[float]:
    """Derivatives of outputs along a direction."""
    unknown, known = ([one.references[n] for n in names] for names in (outputs, seeds))
    return list(one.getDirectionalDerivative(unknown, known, list(seeds.values())))


def opened(one: FMU2Told) -> FMU2Told:
    """In initialisation, with the first angles."""
    one.setupExperiment()
    one.enterInitializationMode()
    one.put(**FIRST)
    return one


def test_the_start_follows_equation_1() -> None:
    """x = r (phi1 + phi2) / 2, y = r (phi1 - phi2) / 2; the outputs stay as they were."""
    radius = machine().parameters["pulley_radius"]
    with slave() as one:
        opened(one)
        before = one.read("x", "y", "tension1")
        outputs = ["x", "y", "phi1_meas", "vx"]
        expected = {
            "phi1": [radius / 2, radius / 2, 1.0, 0.0],
            "phi2": [radius / 2, -radius / 2, 0.0, 0.0],
            "pulley.radius": [2.0, 1.0, 0.0, 0.0],
            "carriage.mass": [0.0] * 4,
        }
        for name, column in expected.items():
            assert directional(one, outputs, {name: 1.0}) == pytest.approx(
                column, rel=1e-9, abs=1e-9
            )
        both = directional(one, outputs, {"phi1": 2.0, "pulley.radius": -1.0})
        parts = 2 * np.array(expected["phi1"]) - expected["pulley.radius"]
        assert both == pytest.approx(parts, rel=1e-7, abs=1e-9)
        assert one.read("x", "y", "tension1") == before


KINDS = [
    use("sensor_rotation", "sensor"),
    use("pulley_eccentricity", "motor1"),
    use("sensor_scale", "sensor"),
]


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.name)
def test_directional_derivatives_equal_differences(kind: EffectUse) -> None:
    """Of values set from outside, for machines whose outputs bend what they report."""
    from dataclasses import replace

    outputs = ["x", "y", "x_true", "phi1_meas"]
    seeds = {"phi1": 0.7, "phi2": -0.4, "pulley.radius": 1e-3}
    name = f"effects.{kind.name}.{kind.location}.{next(iter(kind.parameters))}"
    chosen = replace(machine(), name=kind.name, effects=(kind,))
    with slave(build_fmu(folder() / kind.name, chosen)) as one:
        opened(one)
        start = {n: one.read(n)[0] for n in (*seeds, name)}
        seeds[name] = 0.1 * start[name]
        found, ends = directional(one, outputs, seeds), []
        for part in (1e-4, -1e-4):
            one.put(**{n: start[n] + part * seed for n, seed in seeds.items()})
            ends.append(np.array(one.read(*outputs)))
        assert found == pytest.approx((ends[0] - ends[1]) / 2e-4, rel=1e-5, abs=1e-9)
        assert found[0] != pytest.approx(found[2], rel=1e-3) or kind.name == "pulley_eccentricity"


def test_during_a_run_no_output_follows_an_input_at_once() -> None:
    """As the description says: nothing changes before the next step."""
    with slave() as one:
        moving(one)
        before = one.read("x", "tension2")
        one.put(phi1=3.0, phi1_rate=1.0)
        assert one.read("x", "tension2") == before
        assert directional(one, ["x", "tension2"], {"phi1": 1.0, "phi1_rate": 1.0}) == [0.0, 0.0]
        assert "now" in one.refusal(
            "getDirectionalDerivative",
            [one.references["x"]],
            [one.references["carriage.mass"]],
            [1.0],
        )


def test_directions_without_a_derivative_are_refused() -> None:
    """Outputs as knowns, seeds that are no numbers, a value at the end of its range."""
    with slave() as one:
        opened(one)
        x, gap = one.references["x"], one.references["effects.backlash.motor1.gap"]
        ask = "getDirectionalDerivative"
        assert "do not follow" in one.refusal(ask, [x], [x], [1.0])
        assert "finite seed" in one.refusal(ask, [x], [one.references["phi1"]], [math.nan])
        assert "no output" in one.refusal(ask, [one.references["phi1"]], [x], [1.0])
        assert "range" in one.refusal(ask, [x], [gap], [1.0])
        assert directional(one, ["x"], {"phi1": 0.0, "effects.backlash.motor1.gap": 0.0}) == [0.0]
