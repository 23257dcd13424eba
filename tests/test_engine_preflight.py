"""Preflight: every mistake of units and wiring is found, told with its fix, and undone."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import machine, other_motion, record, rich_motion, short_motion

from corexy_fmi.engine.data.preflight import check
from corexy_fmi.motion import chain, line, rest
from corexy_fmi.recording import Recording

EVERYTHING = ("x", "y", "vx", "vy", "ax", "ay")
ONE_AXIS = chain(rest((0, 0), 0.05), line((0, 0), (0.02, 0), 0.1, 2.0), rest((0.02, 0), 0.2))


@pytest.fixture(scope="module")
def sound():
    """A healthy recording of the strongly lagging machine."""
    return record(machine(), rich_motion(), channels=("x", "y"))


def changed(recording: Recording, **channels) -> Recording:
    return replace(recording, channels={**recording.channels, **channels})


def texts(recording, chosen=None):
    found = check(recording, chosen or machine())[1]
    assert all(finding.fix.endswith(".") for finding in found)
    return [finding.text for finding in found]


@pytest.mark.parametrize("name", ["yin2018", "light_bench", "gt2_printer", "yin2018_dc"])
@pytest.mark.parametrize("motion", [rich_motion, other_motion, lambda: ONE_AXIS])
def test_a_healthy_recording_yields_nothing(name, motion):
    recording = record(machine(name), motion())
    same, found = check(recording, machine(name))
    assert found == []
    assert same is recording


@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_neither_silence_nor_noise_alarms(noise):
    assert texts(record(machine(), rich_motion(), noise=noise, channels=EVERYTHING)) == []


def test_a_slow_tracker_and_a_machine_off_its_file_are_healthy():
    off = {"belt_axial_stiffness": 0.5, "carriage_viscous_friction": 1.5}
    numbers = {n: v * off.get(n, 1.0) for n, v in machine().parameters.items()}
    truth = replace(machine(), parameters=numbers)
    assert texts(record(truth, rich_motion(), tracker=10)) == []


UNITS = {"mm": 1e3, "cm": 1e2, "inch": 39.3701, "um": 1e6}


@pytest.mark.parametrize(("unit", "factor"), UNITS.items())
def test_units_are_seen_and_undone(sound, unit, factor):
    wrong = changed(sound, x=factor * sound["x"], y=factor * sound["y"])
    right, found = check(wrong, machine())
    assert [f.text for f in found] == [f"train.csv: x and y in {unit}, expected m"]
    assert f"Divide x and y by {factor:g}" in found[0].fix
    assert right["y"] == pytest.approx(sound["y"], rel=1e-12)


def test_one_axis_in_another_unit(sound):
    assert texts(changed(sound, y=1e3 * sound["y"])) == ["train.csv: y in mm, expected m"]


@pytest.mark.parametrize(("factor", "unit"), [(180 / np.pi, "deg"), (0.5 / np.pi, "revolutions")])
def test_commands_in_another_unit(sound, factor, unit):
    wrong = changed(sound, phi1=factor * sound["phi1"], phi2=factor * sound["phi2"])
    right, found = check(wrong, machine())
    assert [f.text for f in found] == [f"train.csv: phi1, phi2 are in {unit}, expected rad"]
    assert right["phi1"] == pytest.approx(sound["phi1"], abs=1e-12)


def test_accelerations_in_their_own_unit():
    recording = record(machine(), rich_motion(), noise=1e-3, channels=EVERYTHING)
    wrong = changed(recording, ax=1e3 * recording["ax"], ay=1e3 * recording["ay"])
    right, found = check(wrong, machine())
    assert [f.text for f in found] == ["train.csv: ax and ay in mm/s^2, expected m/s^2"]
    assert right["ax"] == pytest.approx(recording["ax"])


TURNS = {
    "x mirrored": lambda x, y: (-x, y),
    "y mirrored": lambda x, y: (x, -y),
    "both axes mirrored": lambda x, y: (-x, -y),
    "x and y swapped": lambda x, y: (y, x),
    "x and y swapped, both mirrored": lambda x, y: (-y, -x),
    "axes turned by +90 deg": lambda x, y: (-y, x),
    "axes turned by -90 deg": lambda x, y: (y, -x),
}


@pytest.mark.parametrize(("name", "turn"), TURNS.items())
@pytest.mark.parametrize("names", [("x", "y"), ("vx", "vy"), ("ax", "ay")])
def test_axes_are_told_and_turned_back(name, turn, names):
    noise = {"x": 2e-5, "vx": 1e-3, "ax": 1e-2}[names[0]]
    recording = record(machine(), rich_motion(), noise=noise, channels=names)
    first, second = turn(*(recording[n] for n in names))
    right, found = check(changed(recording, **dict(zip(names, (first, second), strict=True))),
                         machine())  # fmt: skip
    assert [f.text.split(": ")[1].split(" against")[0] for f in found] == [name]
    for channel in names:
        assert right[channel] == pytest.approx(recording[channel])


MOTORS = {
    "the two motors are exchanged": lambda a, b: (b, a),
    "motor 1 turns the wrong way": lambda a, b: (-a, b),
    "motor 2 turns the wrong way": lambda a, b: (a, -b),
    "both motors turn the wrong way": lambda a, b: (-a, -b),
}


@pytest.mark.parametrize(("name", "wired"), MOTORS.items())
def test_motors_exchanged_or_reversed(sound, name, wired):
    first, second = wired(sound["phi1"], sound["phi2"])
    (text,) = texts(changed(sound, phi1=first, phi2=second))
    assert text.endswith(name)


def test_units_and_axes_at_once(sound):
    wrong = changed(sound, x=-1e3 * sound["y"], y=-1e3 * sound["x"])
    right, found = check(wrong, machine())
    assert ["in mm" in found[0].text, "swapped, both mirrored" in found[1].text] == [True, True]
    assert right["x"] == pytest.approx(sound["x"])
    assert check(right, machine())[1] == []


def test_one_direction_alone_is_enough_for_a_sign():
    recording = record(machine(), ONE_AXIS)
    (text,) = texts(changed(recording, x=-recording["x"]))
    assert "x mirrored against the command" in text
    assert "one direction of motion cannot tell more" in text


@pytest.mark.parametrize("ratio", [0.9, 1.1, 1.2])
def test_a_wrong_radius(ratio):
    numbers = dict(machine().parameters)
    numbers["pulley_radius"] *= ratio
    truth = replace(machine(), parameters=numbers)
    recording = record(truth, rich_motion())
    order = record(machine(), rich_motion())
    wrong = changed(recording, phi1=order["phi1"], phi2=order["phi2"])
    wrong = changed(wrong, x=ratio * order["x"], y=ratio * order["y"])
    same, found = check(wrong, machine())
    assert same is wrong
    assert "times the commanded one in both axes" in found[0].text
    guessed = float(found[0].fix.split("pulley_radius looks like ")[1].split(" m")[0])
    assert guessed == pytest.approx(numbers["pulley_radius"], rel=0.01)


def test_one_axis_that_travels_too_far_is_no_radius(sound):
    assert texts(changed(sound, x=1.1 * sound["x"])) == []


def test_a_dead_channel_is_left_out(sound):
    right, found = check(changed(sound, y=np.full(len(sound), 0.25)), machine())
    assert [f.text for f in found] == [
        "train.csv: channel y never changes although the stage is driven"
    ]
    assert "left out" in found[0].fix
    assert right.measured == ("x",)


def test_a_channel_of_noise_alone_is_left_out(sound):
    noise = 1e-5 * np.random.default_rng(5).normal(size=len(sound))
    right, found = check(changed(sound, x=noise), machine())
    assert [f.text for f in found] == ["train.csv: channel x shows none of the commanded motion"]
    assert right.measured == ("y",)


def test_a_channel_that_may_stand_still_does():
    still = record(machine(), ONE_AXIS, noise=0.0)
    assert texts(changed(still, y=np.zeros(len(still)))) == []


def test_a_clipped_channel(sound):
    assert texts(changed(sound, x=np.minimum(sound["x"], 0.02))) == [
        "train.csv: channel x is cut off at 0.02"
    ]
    assert texts(changed(sound, y=np.maximum(sound["y"], -0.01))) == [
        "train.csv: channel y is cut off at -0.01"
    ]


def test_a_coarse_sensor_is_not_clipped(sound):
    coarse = {n: 1e-3 * np.round(sound[n] / 1e-3) for n in ("x", "y")}
    assert texts(changed(sound, **coarse)) == []


def test_a_rest_at_the_end_of_the_stroke_is_not_clipped():
    out = chain(line((0, 0), (0.02, 0.01), 0.1, 2.0), rest((0.02, 0.01), 1.0))
    assert texts(record(machine(), out, noise=0.0)) == []


def test_a_motor_that_moves_nothing(sound):
    half = machine().parameters["pulley_radius"] / 2 * sound["phi1"]
    (text,) = texts(changed(sound, x=half, y=half))
    assert text == "train.csv: motor 2 does not move the stage although it is driven"


def test_a_recording_of_another_run(sound):
    backwards = changed(sound, x=sound["x"][::-1], y=sound["y"][::-1])
    assert any("hardly follows the commanded motion" in text for text in texts(backwards))


def test_encoders_exchanged():
    chosen = machine("yin2018_dc")
    recording = record(chosen, short_motion(), noise=1e-4, channels=("phi1_meas", "phi2_meas"))
    wrong = changed(recording, phi1_meas=recording["phi2_meas"], phi2_meas=recording["phi1_meas"])
    right, found = check(wrong, chosen)
    assert [f.text for f in found] == ["train.csv: the encoders are exchanged"]
    assert right["phi1_meas"] == pytest.approx(recording["phi1_meas"])


def test_voltages_are_judged_by_the_encoders():
    chosen = machine("yin2018_dc")
    recording = record(chosen, short_motion(), channels=("x", "y", "phi1_meas", "phi2_meas"))
    held = {n: v for n, v in recording.channels.items() if n not in ("phi1", "phi2")}
    open_loop = replace(recording, channels=held, metadata={})
    assert texts(open_loop, chosen) == []
    (text,) = texts(changed(open_loop, x=1e3 * recording["x"], y=1e3 * recording["y"]), chosen)
    assert "x and y in mm" in text


def test_a_machine_at_rest_is_not_judged():
    still = record(machine(), chain(rest((0.01, 0), 0.3)), noise=0.0)
    assert texts(changed(still, x=np.full(len(still), 5.0))) == []


def test_a_recording_of_dc_motors_for_a_machine_of_steppers_is_told(sound):
    driven = record(machine("yin2018_dc"), rich_motion())
    assert texts(driven, machine("yin2018_dc")) == []
    told = "train.csv: it has a controller, as dc motors have; the machine has steppers"
    assert told in texts(driven)
    voltages = {f"V{i}": np.zeros(len(sound)) for i in (1, 2)}
    (text,) = texts(changed(sound, **voltages))
    assert "it has voltages" in text
