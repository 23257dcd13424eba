"""Two logs with two clocks made into one recording; logs that share a clock; fmpy's results."""

from dataclasses import replace

import fmpy
import numpy as np
import pytest
from fmpy.util import write_csv
from typer.testing import CliRunner

from corexy_fmi.cli import app
from corexy_fmi.errors import InputError
from corexy_fmi.fmu.signals import fmpy_signals
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import command, star
from corexy_fmi.recording import Recording, read_recording, write_recording
from corexy_fmi.recording.align import Signal, clocks
from corexy_fmi.recording.columns import import_columns
from corexy_fmi.recording.merge import merge
from corexy_fmi.simulate import simulate

MACHINE = load_machine("gt2_printer")
RADIUS = MACHINE.parameters["pulley_radius"]
REST = (RADIUS / 2, RADIUS / 2), (RADIUS / 2, -RADIUS / 2)
OFFSET, DRIFT = 3.217, 80e-6


@pytest.fixture(scope="module")
def logs():
    """Commands, and what another clock's tracker and accelerometer saw of them."""
    order = command(star(0.05, 7, 0.1, 2.0), RADIUS)
    felt = simulate(MACHINE, order)
    late = felt.time * (1 + DRIFT) + OFFSET
    noise = np.random.default_rng(1)
    return order, {
        "x": (late[::9], {n: felt[n][::9] + noise.normal(0, 2e-5, len(late[::9])) for n in "xy"}),
        "ax": (late, {n: felt[n] + noise.normal(0, 0.2, len(late)) for n in ("ax", "ay")}),
    }


@pytest.mark.parametrize("channel", ["x", "ax"])
def test_offset_and_drift_are_found_within_what_they_are_told_to_be(logs, channel):
    order, seen = logs
    time, channels = seen[channel]
    found = merge(order, Recording("b.csv", time, channels), REST, {}, align=True)
    assert found.metadata["clock"] == "free"
    words = found.metadata["aligned"].replace("=", " ").replace("+-", " ").split()
    offset, offset_std, drift, drift_std = (float(words[k]) for k in (1, 2, 5, 6))
    lag = 2e-3  # of the stage behind its command: the clock stays free for it
    assert offset == pytest.approx(OFFSET, abs=lag)
    assert drift == pytest.approx(1e6 * DRIFT, abs=max(4 * drift_std, 20))
    assert 0 < offset_std < 1e-3
    assert 0 < drift_std < 60
    stage = RADIUS * (found["phi1"] + found["phi2"]) / 2
    if channel == "x":
        known = np.isfinite(found["x"])
        course = np.interp(
            found.time, order.time - 0.0, RADIUS * (order["phi1"] + order["phi2"]) / 2
        )
        assert np.sqrt(np.mean((found["x"] - course)[known] ** 2)) < 1e-3
    assert np.isfinite(stage[0])


def test_one_clock_needs_no_alignment(logs):
    order, seen = logs
    time, channels = seen["x"]
    other = Recording("b.csv", (time - OFFSET) / (1 + DRIFT), channels)
    found = merge(order, other, REST, {"note": "one clock"}, align=False)
    assert "clock" not in found.metadata
    assert found.metadata["note"] == "one clock"
    known = np.isfinite(found["x"])
    assert found["x"][known] == pytest.approx(channels["x"])
    assert np.isfinite(found["phi1"]).sum() == len(order.time)


def test_measurements_before_the_first_command_see_it_at_rest(logs):
    order, seen = logs
    time, channels = seen["x"]
    early = Recording("b.csv", time - time[0] - 0.5, channels)
    found = merge(order, early, REST, {}, align=False)
    assert found.time[0] == 0.0
    assert found["phi1"][0] == order["phi1"][0]


def test_logs_that_are_not_of_one_motion(logs):
    order, seen = logs
    noise = np.random.default_rng(0)
    time, _ = seen["x"]
    strange = Recording("b.csv", time, {"x": np.cumsum(noise.normal(0, 1e-5, len(time)))})
    with pytest.raises(InputError, match=r"command and b\.csv: they resemble each other"):
        merge(order, strange, REST, {}, align=True)


def test_a_motion_that_repeats_is_ambiguous():
    time = np.arange(0, 60, 0.01)
    wave = np.sin(2 * np.pi * time)[:, None]
    with pytest.raises(InputError, match="fit alike, expected a motion that does not repeat"):
        clocks(Signal(time, wave), Signal(time + 1.0, wave), "a and b")


def test_short_logs_have_no_drift():
    time = np.arange(0, 2, 1e-3)
    wave = np.exp(-(((time - 1) / 0.1) ** 2))[:, None]
    found = clocks(Signal(time, wave), Signal(time + 0.3, wave), "a and b")
    assert found.offset == pytest.approx(0.3, abs=1e-3)
    assert found.drift == 0
    assert np.isnan(found.drift_std)


def test_the_command_merges_two_logs(logs, tmp_path):
    order, seen = logs
    time, channels = seen["x"]
    steps = {n: order[n] * 200 * 16 / (2 * np.pi) for n in ("phi1", "phi2")}
    write_recording(replace(order, channels={f"m{k}": v for k, v in zip("12", steps.values(),
                    strict=True)}), tmp_path / "a.csv")  # fmt: skip
    write_recording(Recording("", time, {f"p{n}": 1e3 * v for n, v in channels.items()}),
                    tmp_path / "b.csv")  # fmt: skip
    out = tmp_path / "run.csv"
    maps = ["time=time", "phi1=m1[steps/16]", "phi2=m2[steps/16]", "time=time", "x=px[mm]",
            "y=py[mm]"]  # fmt: skip
    words = ["import", "csv", "--commands", str(tmp_path / "a.csv"), "--measured",
             str(tmp_path / "b.csv"), "--align", "--machine", "gt2_printer",
             "--out", str(out)]  # fmt: skip
    done = CliRunner().invoke(app, [*words, *(w for m in maps for w in ("--map", m))])
    assert done.exit_code == 0, done.output
    assert "offset=3.21" in done.output
    found = read_recording(out)
    known = np.isfinite(found["phi1"])
    assert np.ptp(found["phi1"][known]) == pytest.approx(np.ptp(order["phi1"]))
    assert found.metadata["clock"] == "free"


@pytest.mark.parametrize(
    "words", [[], ["a.csv", "--align"], ["--commands", "a.csv"], ["--measured", "b.csv"]]
)
def test_half_a_pair_is_refused(words, tmp_path):
    done = CliRunner().invoke(app, ["import", "csv", *words, "--out", str(tmp_path / "o.csv")])
    assert isinstance(done.exception, InputError)
    assert "--commands A.csv with --measured B.csv" in str(done.exception)


@pytest.mark.parametrize(
    ("unit", "turns"),
    [("steps", 1 / 200), ("steps/16", 1 / 3200), ("steps400", 1 / 400), ("steps400/32", 1 / 12800),
     ("degrees", 1 / 360), ("deg", 1 / 360)],
)  # fmt: skip
def test_steps_and_degrees(tmp_path, unit, turns):
    path = tmp_path / "m.csv"
    path.write_text("time,m\n0,0\n1,1\n")
    found = import_columns(path, ["time=time", f"phi1=m[{unit}]"], {}, RADIUS)
    assert found["phi1"][1] == pytest.approx(2 * np.pi * turns, rel=1e-12)


@pytest.mark.parametrize("unit", ["steps/0", "steps0", "steps/x", "degree"])
def test_units_that_are_none(tmp_path, unit):
    path = tmp_path / "m.csv"
    path.write_text("time,m\n0,0\n1,1\n")
    with pytest.raises(InputError, match=f"unit '{unit}', expected one of m, mm"):
        import_columns(path, ["time=time", f"phi1=m[{unit}]"], {}, RADIUS)


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """fmpy's result of a run of the FMU, with its inputs among the outputs, and without."""
    folder = tmp_path_factory.mktemp("fmpy")
    done = CliRunner().invoke(app, ["build", "--machine", "gt2_printer", "--out", str(folder)])
    assert done.exit_code == 0, done.output
    order = command(star(0.02, 3, 0.1, 2.0), RADIUS)
    for name, output in (("all", ["phi1", "phi2", "x", "y"]), ("seen", ["x", "y"])):
        result = fmpy.simulate_fmu(str(folder / "CoreXY.fmu"), input=fmpy_signals(order),
                                   output=output, stop_time=order.time[-1],
                                   output_interval=1e-3)  # fmt: skip
        write_csv(str(folder / f"{name}.csv"), result)
    write_recording(order, folder / "order.csv")
    return folder


def test_a_result_of_fmpy_is_a_recording(simulated):
    found = read_recording(simulated / "all.csv")
    again = simulate(MACHINE, found)
    assert np.abs(again["x"] - found["x"]).max() < 5e-6
    assert np.ptp(found["x"]) > 0.02


def test_a_result_without_inputs_is_merged_with_them(simulated, tmp_path):
    out = tmp_path / "run.csv"
    with pytest.raises(InputError, match="no input columns, expected phi1 and phi2"):
        read_recording(simulated / "seen.csv")
    words = ["import", "csv", "--commands", str(simulated / "order.csv"), "--measured",
             str(simulated / "seen.csv"), "--machine", "gt2_printer",
             "--out", str(out)]  # fmt: skip
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    found = read_recording(out)
    error = (simulate(MACHINE, found)["x"] - found["x"])[np.isfinite(found["x"])]
    assert np.abs(error).max() < 5e-6
