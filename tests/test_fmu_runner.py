"""The FMU against the kernel: every machine, every effect, every step, both flavours."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmu_kit import (
    FLAVOURS,
    LIMIT,
    diseased,
    folder,
    largest,
    machine,
    rectangle,
    slave,
    template,
    use,
)

from corexy_fmi.effects import catalogue
from corexy_fmi.errors import InputError
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.fmu.runner import carried_machine, parameter_values, run_fmu
from corexy_fmi.fmu.signals import fmpy_signals
from corexy_fmi.machine import FreeForm, Machine
from corexy_fmi.motion import Motion, command, row_times
from corexy_fmi.recording import Recording, read_recording, write_recording
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.simulate import simulate

PLACES = [(e.name, place) for e in catalogue().values() for place in e.locations]


def with_effect(name: str, location: str) -> Machine:
    """A bundled machine of a drive that knows the effect, with it."""
    exact = name == "periodic_disturbance" and location.startswith("motor")  # no torque turns it
    stepper = "stepper" in catalogue()[name].drives and not exact
    return replace(machine("yin2018" if stepper else "yin2018_dc"), effects=(use(name, location),))


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.parametrize("name", ["yin2018", "light_bench", "gt2_printer", "yin2018_dc"])
def test_a_machine_inside_equals_the_kernel(name: str, flavour: str) -> None:
    """Over a rectangle run; the recording has the channels of `simulate`."""
    chosen = machine(name)
    order = rectangle(chosen, size=0.02)
    expected = simulate(chosen, order)
    found = run_fmu(build_fmu(folder() / name, chosen, flavour), order)
    assert list(found.channels) == list(expected.channels)
    assert largest(found, expected, "x", "y") < LIMIT
    assert largest(found, expected) < 1e-6


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.parametrize(("name", "location"), PLACES)
def test_each_effect_set_as_parameter_equals_the_kernel(
    name: str, location: str, flavour: str
) -> None:
    """The template with start values; and the effect does something."""
    chosen = with_effect(name, location)
    order = rectangle(chosen)
    expected = simulate(chosen, order)
    assert largest(run_fmu(template(flavour), order, chosen), expected, "x", "y") < LIMIT
    assert largest(simulate(replace(chosen, effects=()), order), expected, "x", "y") > 1e-9


def test_the_flavours_agree() -> None:
    """To 1e-12 m over a rectangle run with effects."""
    runs = [run_fmu(template(f), rectangle(machine(), size=0.02), diseased()) for f in FLAVOURS]
    assert largest(*runs) < 1e-12


@pytest.mark.parametrize("fidelity", ["reduced", "kinematic", "condensed"])
@pytest.mark.parametrize("flavour", FLAVOURS)
def test_other_fidelities_equal_the_kernel(fidelity: str, flavour: str) -> None:
    """Chosen by the enumeration; kinematic is eq. (1)."""
    chosen = replace(machine(), fidelity=fidelity)
    order = rectangle(chosen)
    found = run_fmu(template(flavour), order, chosen)
    assert largest(found, simulate(chosen, order), "x", "y", "vx") < LIMIT
    if fidelity == "kinematic":
        radius = chosen.parameters["pulley_radius"]
        assert np.abs(found["x"] - radius * (order["phi1"] + order["phi2"]) / 2).max() < 1e-15


def test_voltages_without_a_loop_are_held() -> None:
    """A dc recording of voltages; the run starts at the first encoder values."""
    chosen = replace(machine("yin2018_dc"), controller=None)
    time = np.linspace(0.0, 0.1, 101)
    volts = np.where(time < 0.05, 0.4, -0.3)
    start = np.full(101, 2.0)
    given = {"V1": volts, "V2": 0.5 * volts, "phi1_meas": start, "phi2_meas": 0 * start}
    order = Recording("volts.csv", time, given)
    found = run_fmu(build_fmu(folder() / "volts", chosen), order)
    assert largest(found, simulate(chosen, order), "x", "y") < LIMIT
    assert found["x"][0] == pytest.approx(0.005)


@pytest.mark.parametrize(
    ("acts", "location", "argument"),
    [("force", at, of) for at in ("x", "y", "motor1", "motor2") for of in ("vx", "y", "phi2", "t")]
    + [("friction", "y", of) for of in "xyt"],
)
def test_free_form_laws_equal_the_kernel(acts: str, location: str, argument: str) -> None:
    """On every coordinate, over speed, position, angle and time; a friction on an axis."""
    more = {"onset": 0.1} if argument == "t" else {}
    more |= {"viscous": 8.0} if acts == "friction" else {}
    law = FreeForm(location, argument, (-0.5, 0.01, 0.2), (0.01, -0.02, 0.03), acts, **more)
    chosen = replace(machine("yin2018_dc"), free_forms=(law,))
    order = rectangle(chosen)
    expected = simulate(chosen, order)
    assert largest(run_fmu(template(), order, chosen), expected, "x", "y") < LIMIT
    assert largest(simulate(replace(chosen, free_forms=()), order), expected, "x", "y") > 1e-9


def sampled(motion: Motion, chosen: Machine, step: float) -> Recording:
    """A command with rows at whole steps."""
    time = step * np.arange(round(motion.duration / step) + 1)
    x, y = motion.position(time).T
    radius = chosen.parameters["pulley_radius"]
    return Recording("steps.csv", time, {"phi1": (x + y) / radius, "phi2": (x - y) / radius})


def test_communication_steps_agree_where_corners_lie_on_all_grids() -> None:
    """0.5, 1, 2 and 7 ms within 1 um."""
    chosen = machine()
    motion = Rectangle(0.014, 0.0098, 0.1).motion
    runs = [run_fmu(template(), sampled(motion, chosen, s)) for s in (0.5e-3, 1e-3, 2e-3, 7e-3)]
    common = np.arange(int(motion.duration / 14e-3)) * 14e-3
    paths = [np.array([np.interp(common, r.time, r[n]) for n in ("x", "y")]) for r in runs]
    assert max(np.abs(a - b).max() for a, b in pairwise(paths)) < 1e-6


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_delay_survives_changing_steps_and_a_saved_state(flavour: str) -> None:
    """Steps of every size, with a state saved and restored on the way, report x(t - delay)."""
    late = replace(machine(), fidelity="kinematic", effects=(use("sensor_delay", "sensor"),))
    delay, rate, now = late.effects[0].parameters["delay"], 4.0, 0.0
    values = parameter_values(late)
    with slave(template(flavour)) as one:
        real = [n for n, v in values.items() if one.kinds[n] == "Real"]
        whole = [n for n in values if n not in real]
        one.setReal([one.references[n] for n in real], [values[n] for n in real])
        one.setInteger([one.references[n] for n in whole], [int(values[n]) for n in whole])
        one.begin()
        one.put(phi1_rate=rate, phi2_rate=rate)
        for step in (1e-4, 7e-4, 1e-3, 3e-3, 2e-4, 5e-4, 1.3e-3) * 3:
            one.put(phi1=rate * now, phi2=rate * now)
            saved = one.getFMUstate()
            one.doStep(now, step)
            wanted = one.read("x", "x_true", "time")
            one.setFMUstate(saved)
            one.freeFMUstate(saved)
            one.doStep(now, step)
            assert one.read("x", "x_true", "time") == wanted
            now += step
            speed = rate * late.parameters["pulley_radius"]
            assert wanted[0] == pytest.approx(speed * max(now - delay, 0.0), abs=1e-12)
            assert wanted[1] == pytest.approx(speed * now, abs=1e-12)


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_fmpys_own_simulation_runs_a_recording(flavour: str) -> None:
    """With the array of `fmpy_signals` it equals `simulate`, start values included."""
    chosen = diseased()
    order = rectangle(chosen)
    result = fmpy.simulate_fmu(
        str(template(flavour)),
        input=fmpy_signals(order),
        start_values=parameter_values(chosen),
        stop_time=order.time[-1],
        output_interval=1e-3,
        output=["x", "y"],
    )
    expected = simulate(chosen, order)
    for name in ("x", "y"):
        seen = np.interp(order.time, result["time"], result[name])
        assert np.abs(seen - expected[name]).max() < LIMIT


def test_a_csv_runs_in_fmpy_and_its_result_is_a_recording(tmp_path: Path) -> None:
    """A plain file of time, phi1, phi2: angles held; fmpy's result file reads back."""
    order = rectangle(machine())
    write_recording(order, tmp_path / "in.csv", plain=True)
    result = fmpy.simulate_fmu(
        str(template()),
        input=fmpy.read_csv(tmp_path / "in.csv"),
        stop_time=order.time[-1],
        output_interval=1e-3,
        output=["phi1", "phi2", "x", "y", "phi1_meas", "phi2_meas"],
    )
    fmpy.write_csv(tmp_path / "out.csv", result)
    found = read_recording(tmp_path / "out.csv")
    assert found.measured == ("x", "y", "phi1_meas", "phi2_meas")
    expected = simulate(machine(), order)
    seen = np.interp(order.time, found.time, found["x"])
    assert 1e-6 < np.abs(seen - expected["x"]).max() < 1e-4


def test_start_values_count_on_top_of_the_machine_inside() -> None:
    """A diagnosed FMU with one effect switched off again."""
    chosen = diseased()
    fewer = replace(chosen, effects=chosen.effects[1:])
    order = rectangle(chosen)
    fmu = build_fmu(folder() / "diseased", chosen)
    result = fmpy.simulate_fmu(
        str(fmu), input=fmpy_signals(order), stop_time=order.time[-1], output_interval=1e-3,
        start_values={"effects.backlash.motor1.gap": 0.0}, output=["x"],
    )  # fmt: skip
    seen = np.interp(order.time, result["time"], result["x"])
    assert np.abs(seen - simulate(fewer, order)["x"]).max() < LIMIT


def test_rows_at_uneven_times_equal_the_kernel() -> None:
    """Each corner is a row of its own, between those of the clock."""
    chosen = machine()
    motion = Rectangle(0.0061, 0.00437, 0.0793).motion
    order = command(motion, chosen.parameters["pulley_radius"])
    assert len(np.unique(np.round(np.diff(row_times(motion, 1000.0)), 6))) > 2
    assert largest(run_fmu(template(), order), simulate(chosen, order), "x", "y") < LIMIT


def test_what_is_no_fmu_is_told_in_one_line(tmp_path: Path) -> None:
    """No zip, no description, no machine, no binary; and nothing stays unpacked."""
    order = rectangle(machine())
    text = tmp_path / "text.fmu"
    text.write_text("no zip")
    with pytest.raises(InputError, match="expected an FMU"):
        run_fmu(text, order)
    with pytest.raises(InputError, match="expected an FMU"):
        run_fmu(tmp_path / "absent.fmu", order)
    for lost, word in (("modelDescription.xml", "description"), ("machine.toml", "machine.toml"),
                       ("binaries", "binary"), ("machine.txt", "cannot be read")):  # fmt: skip
        with pytest.raises(InputError, match=word):
            run_fmu(without(template(), lost, tmp_path / "less.fmu"), order)


def without(fmu: Path, part: str, target: Path) -> Path:
    """A copy of an FMU that lacks the files whose names hold a part."""
    from corexy_fmi.fmu.archive import read_archive, write_archive

    write_archive(target, {k: v for k, v in read_archive(fmu).items() if part not in k})
    return target


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_refusal_carries_the_fmus_own_sentence(
    flavour: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And the folder is cleaned up (one of this test's own: others unpack beside it)."""
    wrong = replace(machine(), parameters={**machine().parameters, "carriage_mass": -1.0})
    fmu, order = template(flavour), rectangle(machine())
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(InputError, match=r"carriage\.mass: found -1"):
        run_fmu(fmu, order, wrong)
    assert list(tmp_path.glob("corexy-fmu-*")) == []


@pytest.mark.parametrize("name", ["light_bench", "yin2018_dc"])
def test_rows_that_were_lost_are_run_and_left_out(name: str) -> None:
    chosen = machine(name)
    order = rectangle(chosen, size=0.02)
    kept = np.delete(np.arange(len(order)), [len(order) // 3, len(order) // 3 + 1, 400])
    channels = {n: v[kept] for n, v in order.channels.items()}
    cut = replace(order, time=order.time[kept], channels=channels)
    found = run_fmu(build_fmu(folder() / f"lost-{name}", chosen), cut)
    assert np.array_equal(found.time, cut.time)
    assert largest(found, simulate(chosen, cut), "x", "y") < LIMIT


def test_a_machine_inside_that_is_none_is_told(tmp_path: Path) -> None:
    (tmp_path / "resources").mkdir()
    (tmp_path / "resources" / "machine.toml").write_text('effects = ["a"]\n')
    with pytest.raises(InputError, match=r"resources/machine.toml: effects\[1\]: found 'a'"):
        carried_machine(tmp_path, "odd.fmu")
