"""The native FMU against its master: call order, refusals, states, instances."""

from __future__ import annotations

import math
from xml.etree.ElementTree import parse

import numpy as np
import pytest
from fmu_kit import FMU2Told, slave, template

from corexy_fmi.fmu.session import unpacked


def wander(one: FMU2Told, start: float, steps: int, step: float = 1e-3) -> list[list[float]]:
    """Outputs along a ramp with a bend."""
    found = []
    for n in range(steps):
        now = start + n * step
        one.put(phi1=20 * now, phi2=-8 * now + 30 * max(0.0, now - 0.02))
        one.slope(20.0, 22.0 if now >= 0.02 else -8.0)
        one.doStep(now, step)
        found.append(one.read("x", "y", "vx", "tension3", "ax"))
    return found


def test_a_run_starts_at_rest_where_the_first_angles_point() -> None:
    """Eq. (1) of the inputs at the end of initialisation, also before it ends."""
    with slave() as one:
        one.setupExperiment(startTime=0.0)
        one.enterInitializationMode()
        one.put(phi1=3.0, phi2=1.0)
        early = one.read("x", "y")
        one.exitInitializationMode()
        assert early == one.read("x", "y") == pytest.approx([0.01, 0.005], rel=1e-12)
        assert one.read("vx", "vy", "phi1_meas", "tension1") == [0.0, 0.0, 3.0, 0.0]


@pytest.mark.parametrize("step", [1e-5, 0.3e-3, 1e-3, 7e-3, 0.5])
def test_any_step_above_zero_is_taken_whole(step: float) -> None:
    """At constant speed the angle of the rotor is rate times time, whatever the step."""
    with slave() as one:
        one.begin()
        for n in range(3):
            one.put(phi1=2.0 * n * step, phi2=0.0)
            one.slope(2.0, 0.0)
            one.doStep(n * step, step)
        assert one.read("time")[0] == pytest.approx(3 * step, rel=1e-15)
        assert one.read("phi1_meas")[0] == pytest.approx(6 * step, rel=1e-12)


def test_rates_come_as_derivatives_or_as_inputs() -> None:
    """Both give the same bits; a derivative counts more, and ends where an angle is set anew."""
    ends = []
    for by_input in (False, True):
        with slave() as one:
            one.begin()
            one.put(phi1=0.0, phi2=0.0)
            if by_input:
                one.put(phi1_rate=5.0, phi2_rate=-3.0)
            else:
                one.put(phi1_rate=77.0)
                one.slope(5.0, -3.0)
            one.doStep(0.0, 0.01)
            ends.append(one.read("x", "y", "phi1", "phi2"))
    assert ends[0] == ends[1]
    assert ends[0][2:] == [0.05, -0.03]


def test_an_angle_set_without_derivative_stands_still() -> None:
    """The derivative of the last step is not kept."""
    with slave() as one:
        one.begin()
        one.slope(5.0, 0.0)
        one.doStep(0.0, 0.01)
        one.put(phi1=0.05)
        one.doStep(0.01, 0.01)
        assert one.read("phi1_meas") == [0.05]


def test_an_angle_that_is_not_set_again_goes_on() -> None:
    """A constant rate needs to be told once."""
    with slave() as one:
        one.begin()
        one.slope(5.0, 0.0)
        for n in range(10):
            one.doStep(n * 1e-3, 1e-3)
        assert one.read("phi1_meas")[0] == pytest.approx(0.05, rel=1e-12)


def test_a_restored_state_continues_bit_for_bit() -> None:
    """Saved in the middle of a run, used twice, in another instance, and through bytes."""
    with slave() as one, slave() as other:
        for each in (one, other):
            each.begin()
        wander(one, 0.0, 17)
        saved = one.getFMUstate()
        data = one.serializeFMUstate(saved)
        first = wander(one, 0.017, 20)
        one.setFMUstate(saved)
        assert wander(one, 0.017, 20) == first
        again = other.deSerializeFMUstate(data)
        other.setFMUstate(again)
        assert wander(other, 0.017, 20) == first
        one.freeFMUstate(saved)
        other.freeFMUstate(again)


def test_reset_gives_the_first_run_again() -> None:
    """Also after another machine was set."""
    with slave() as one:
        one.begin()
        first = wander(one, 0.0, 30)
        one.reset()
        one.setReal([one.references["carriage.mass"]], [0.5])
        one.begin()
        assert wander(one, 0.0, 30) != first
        one.reset()
        one.begin()
        assert wander(one, 0.0, 30) == first


def test_instances_do_not_touch_each_other() -> None:
    """Two in one process, stepped in turns, equal two alone."""
    with slave() as alone:
        alone.begin()
        expected = wander(alone, 0.0, 30)
    with unpacked(template()) as place:
        one, other = FMU2Told(place, "one").open(), FMU2Told(place, "other").open()
        one.begin()
        other.begin(phi1=1.0, phi2=2.0)
        for n in range(30):
            assert wander(one, n * 1e-3, 1) == expected[n : n + 1]
            other.doStep(n * 1e-3, 1e-3)
        assert other.read("phi1_meas") == [1.0]
        one.fmi2FreeInstance(one.component)
        other.fmi2FreeInstance(other.component)


def test_reading_twice_changes_nothing() -> None:
    """Outputs are found once for each step, so a curious master sees the same run."""
    with slave() as one, slave() as other:
        one.begin()
        other.begin()
        for n in range(20):
            rows = wander(one, n * 1e-3, 1), wander(other, n * 1e-3, 1)
            for _ in range(3):
                one.read("x", "ax", "tension7")
            assert rows[0] == rows[1]


def test_calls_out_of_order_are_refused_with_a_sentence() -> None:
    """As the state machine of the standard wants it; a refused call changes nothing."""
    with slave() as one:
        x = [one.references["x"]]
        assert "expected initialized" in one.refusal("doStep", 0.0, 1e-3)
        assert "initialization mode" in one.refusal("exitInitializationMode")
        assert "expected initialized" in one.refusal("terminate")
        one.begin()
        assert "instantiated" in one.refusal("enterInitializationMode")
        assert "instantiated" in one.refusal("setupExperiment", None, 0.0, None)
        assert "fixed" in one.refusal("setReal", [one.references["carriage.mass"]], [1.0])
        assert "fixed" in one.refusal("setInteger", [one.references["drive"]], [2])
        assert "calculated" in one.refusal("setReal", x, [1.0])
        one.doStep(0.0, 1e-3)
        one.terminate()
        assert "terminated" in one.refusal("doStep", 1e-3, 1e-3)
        assert "terminated" in one.refusal("setReal", [one.references["phi1"]], [1.0])
        assert len(one.getReal(x)) == 1


@pytest.mark.parametrize("step", [0.0, -1e-3, math.nan, math.inf])
def test_a_step_that_is_not_above_zero_is_refused(step: float) -> None:
    """And the run goes on where it was."""
    with slave() as one:
        one.begin()
        assert "communicationStepSize" in one.refusal("doStep", 0.0, step)
        one.doStep(0.0, 1e-3)
        assert one.read("time") == [1e-3]


@pytest.mark.parametrize("point", [0.5, -1.0, math.nan])
def test_a_jump_in_time_is_refused(point: float) -> None:
    """Rounding of the master's clock is none."""
    with slave() as one:
        one.begin()
        one.doStep(0.0, 1e-3)
        assert "currentCommunicationPoint" in one.refusal("doStep", point, 1e-3)
        one.doStep(1e-3 * (1 + 1e-12), 1e-3)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_values_that_are_no_numbers_are_refused(value: float) -> None:
    """Inputs, parameters, derivatives; nothing of the call is set."""
    with slave() as one:
        phi = [one.references["phi1"], one.references["phi2"]]
        assert "phi2" in one.refusal("setReal", phi, [1.0, value])
        assert one.read("phi1") == [0.0]
        assert "carriage.mass" in one.refusal("setReal", [one.references["carriage.mass"]], [value])
        assert "finite" in one.refusal("setRealInputDerivatives", phi, [1, 1], [0.0, value])
        assert "order 1" in one.refusal("setRealInputDerivatives", phi, [1, 2], [0.0, 0.0])


def test_values_out_of_range_are_refused_by_name() -> None:
    """With the range that was expected; an effect's neutral value is always allowed."""
    with slave() as one:
        mass = [one.references["effects.tool_mode.tool.mass"]]
        assert one.status("setReal", mass, [0.1]) == one.status("setReal", mass, [0.0]) == 0
        assert "from 0.001 to 2" in one.refusal("setReal", mass, [1e-6])
        assert "drive" in one.refusal("setInteger", [one.references["drive"]], [3])
        assert "unknown" in one.refusal("getReal", [99999])
        assert "type" in one.refusal("getReal", [one.references["drive"]])
        assert "no variables" in one.refusal("setString", [0], ["a"])


def test_parameters_that_contradict_each_other_are_refused() -> None:
    """When the initialisation ends; what is wrong can then be set right."""
    with slave() as one:
        name = "effects.pulley_eccentricity.pulley5.amplitude"
        one.setInteger([one.references["fidelity"]], [2])
        one.setReal([one.references[name]], [1e-4])
        one.setupExperiment()
        one.enterInitializationMode()
        sentence = one.refusal("exitInitializationMode")
        assert name in sentence
        assert "reduced" in sentence
        one.setReal([one.references[name]], [0.0])
        one.exitInitializationMode()


@pytest.mark.parametrize(
    ("values", "whole", "word"),
    [
        ({"carriage.clipSpacing": 0.3}, {}, "bridge.pulleySpacing"),
        ({}, {"drive": 2, "fidelity": 3}, "kinematic"),
        ({}, {"drive": 2, "fidelity": 4}, "condensed"),
        ({"effects.free_form.x.knots[1]": 1.0}, {"effects.free_form.x.count": 2}, "increasing"),
        ({"effects.stepper_compliance.motors.holding_torque": 0.3}, {"drive": 2}, "dc"),
    ],
)
def test_each_contradiction_has_its_sentence(
    values: dict[str, float], whole: dict[str, int], word: str
) -> None:
    """At the end of the initialisation."""
    with slave() as one:
        one.setReal([one.references[n] for n in values], list(values.values()))
        one.setInteger([one.references[n] for n in whole], list(whole.values()))
        one.setupExperiment()
        one.enterInitializationMode()
        assert word in one.refusal("exitInitializationMode")


def test_what_is_not_offered_is_refused() -> None:
    """Cancelling a step, a status that never is pending."""
    with slave() as one:
        one.begin()
        assert "complete" in one.refusal("cancelStep")
        assert one.status("getStatus", 0) == 2
        one.doStep(0.0, 0.25)
        assert one.getRealStatus(2) == 0.25
        assert one.getBooleanStatus(3) is False


def test_bytes_that_are_no_state_are_refused() -> None:
    """Cut short, of another size, or with one bit turned."""
    with slave() as one:
        one.begin()
        saved = one.getFMUstate()
        data = bytearray(one.serializeFMUstate(saved))
        data[len(data) // 2] ^= 1
        for wrong in (bytes(data), bytes(data[:-1]), b"nonsense"):
            assert "no state" in one.refusal("deSerializeFMUstate", wrong)
        one.freeFMUstate(saved)


def test_a_state_that_blows_up_is_told_and_can_be_reset() -> None:
    """An angle beyond all bounds overflows; afterwards only a reset or a state helps."""
    with slave() as one:
        one.begin()
        one.put(phi1=1e308, phi2=1e308)
        assert "not finite" in one.refusal("doStep", 0.0, 1e-3)
        assert "failed" in one.refusal("doStep", 1e-3, 1e-3)
        one.reset()
        one.begin()
        one.doStep(0.0, 1e-3)
        assert np.isfinite(one.read("x")).all()


@pytest.mark.parametrize("category", ["logEvents", "logAll", None])
def test_logging_tells_events_only_where_it_is_on(category: str | None) -> None:
    """By their category, by all, or by none; unknown categories are refused."""
    chosen = [category] if category else []
    with slave() as one:
        assert one.messages == []
        one.setDebugLogging(True, chosen)
        one.begin()
        assert "micro-steps" in one.messages[-1]
        assert (one.categories, one.statuses) == (["logEvents"], [0])
        assert "unknown" in one.refusal("setDebugLogging", True, ["logNothing"])
        one.setDebugLogging(False, chosen)
        one.reset()
        one.begin()
        assert len(one.messages) == 2


def test_each_message_carries_a_category_of_the_description() -> None:
    """Errors and discards are told in any case, under their own."""
    with slave() as one:
        one.setDebugLogging(False, ["logStatusError", "logStatusDiscard"])
        one.begin()
        assert one.messages == []
        one.refusal("doStep", 0.0, -1.0)
        assert one.status("getStatus", 0) == 2
        assert one.categories == ["logStatusError", "logStatusDiscard"]
        assert one.statuses == [3, 2]
        declared = parse(one.place / "modelDescription.xml").getroot().iter("Category")
        names = {category.get("name") for category in declared}
        assert names == {"logEvents", "logStatusError", "logStatusDiscard", "logAll"}


def test_nothing_is_computed_beyond_the_stop_time() -> None:
    """As the standard wants it; rounding of the master's clock is allowed for."""
    with slave() as one:
        one.setupExperiment(startTime=0.0, stopTime=0.003)
        one.enterInitializationMode()
        one.exitInitializationMode()
        one.doStep(0.0, 1e-3)
        assert "stopTime" in one.refusal("doStep", 1e-3, 2.1e-3)
        one.doStep(1e-3, 2e-3 * (1 + 1e-9))
        assert "stopTime" in one.refusal("doStep", 3e-3, 1e-3)
        one.terminate()
        one.reset()
        one.begin()
        one.doStep(0.0, 1.0)
