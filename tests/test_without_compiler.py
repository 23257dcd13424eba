"""Without a C compiler: what is cached still runs, what is not runs in Python, no FMU is built."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from engine_kit import DELAY, machine, record, short_motion, with_effects
from own_effects import BOW

from corexy_fmi.commands.diagnose import diagnose
from corexy_fmi.kernel import call, compiler, without_compiler
from corexy_fmi.kernel.call import run_lanes, step_limit
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.kernel.without_compiler import slow_step_limit
from corexy_fmi.machine import EffectUse, save_machine
from corexy_fmi.motion import command
from corexy_fmi.recording import write_recording
from corexy_fmi.simulate import excitation, machine_vector


@pytest.fixture
def bare(monkeypatch):
    """No compiler, and a cache that holds the bundled kernel; forgotten afterwards."""
    assert all(call.has_kernel(bundled_layout(), lanes) for lanes in (1, call.LANES))
    caches = (compiler.find_compiler, call.has_kernel, call._library)
    for cached in caches:
        cached.cache_clear()
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CC", raising=False)
    no_zig = SimpleNamespace(find_spec=lambda name: None)
    monkeypatch.setattr(compiler, "importlib", SimpleNamespace(util=no_zig))
    yield monkeypatch
    for cached in caches:
        cached.cache_clear()


def few_rows(chosen, rows=60):
    order = command(short_motion(), chosen.parameters["pulley_radius"])
    whole = excitation(chosen, order)
    cut = {n: getattr(whole, n)[40 : 40 + rows] for n in ("time", "input1", "input2")}
    return replace(whole, **cut)


USES = (
    EffectUse("tool_mode", "tool", {"mass": 0.1, "frequency": 60.0, "damping_ratio": 0.05}),
    EffectUse("stepper_compliance", "motors", {"holding_torque": 0.4, "damping": 1e-3}),
    EffectUse("belt_stiffness_vs_position", "belts", {"strength": 0.6}),
    EffectUse("belt_damping", "belts", {"time": 2e-4}),
    EffectUse("racking", "bridge", {"stiffness": 400.0, "inertia": 1e-3}),
)


@pytest.mark.parametrize("use", [None, *USES], ids=lambda u: u.name if u else "bare")
@pytest.mark.parametrize("name", ["yin2018", "gt2_printer"])
def test_the_step_is_the_kernels(use, name):
    chosen = with_effects(machine(name), *([use] if use else []))
    vector = machine_vector(chosen)
    kernel = step_limit(bundled_layout(), vector, fidelity=chosen.stage)
    assert slow_step_limit(bundled_layout(), vector, chosen.stage, False) == pytest.approx(kernel)


@pytest.mark.parametrize(
    "changes", [{"fidelity": "reduced"}, {"name": "yin2018_dc"}, {"name": "emps"}]
)
def test_the_step_is_the_kernels_on_other_stages(changes):
    chosen = machine(**changes)
    vector, dc = machine_vector(chosen), chosen.drive == "dc"
    kernel = step_limit(bundled_layout(), vector, fidelity=chosen.stage, dc=dc)
    assert slow_step_limit(bundled_layout(), vector, chosen.stage, dc) == pytest.approx(kernel)


def test_nothing_cached_runs_in_python_and_gives_the_same(bare, tmp_path):
    chosen, drive = machine(), few_rows(machine())
    vectors = np.array([machine_vector(chosen), machine_vector(with_effects(chosen, DELAY))])
    inputs = np.array([drive.input1, drive.input2])[:, None] * np.array([1.0, 0.8])[:, None]
    kernel = run_lanes(bundled_layout(), drive, vectors, inputs=inputs)
    call.has_kernel.cache_clear()
    call._library.cache_clear()
    bare.setenv("COREXY_CACHE", str(tmp_path))
    assert not call.has_kernel(bundled_layout(), call.LANES)
    slow = run_lanes(bundled_layout(), drive, vectors, inputs=inputs)
    assert np.ptp(kernel) > 1e-4
    np.testing.assert_allclose(slow, kernel, rtol=0, atol=1e-11)


def test_a_run_that_breaks_down_is_not_finite(bare, tmp_path):
    bare.setenv("COREXY_CACHE", str(tmp_path))
    chosen = with_effects(machine(), EffectUse("cable_drag", "x", {"stiffness": 1e12}))
    out = run_lanes(bundled_layout(), few_rows(chosen), machine_vector(chosen)[None], limit=1e-3)
    assert not np.isfinite(out).all()


def short(chosen, name, seed):
    """A kinematic recording at 200 Hz; rows are all that a kinematic run costs."""
    whole = record(chosen, short_motion(), name, seed=seed)
    thin = {n: v[::5] for n, v in whole.channels.items()}
    return replace(whole, time=whole.time[::5], channels=thin)


def test_an_own_effect_is_diagnosed_and_its_fmu_refused(bare, tmp_path, capsys):
    chosen = machine(fidelity="kinematic")
    truth = with_effects(chosen, replace(DELAY, parameters={"delay": 0.02}))
    save_machine(chosen, tmp_path / "machine.toml")
    for seed, name in enumerate(("run.csv", "judge.csv")):
        write_recording(short(truth, name, seed), tmp_path / name)
    (tmp_path / "my_bow.py").write_text(BOW)
    out = tmp_path / "result"
    out.mkdir()
    (out / "CoreXY.fmu").write_text("of an earlier diagnosis")
    slowly = []
    reference = without_compiler.run_reference
    bare.setattr(
        without_compiler, "run_reference", lambda *a, **k: slowly.append(1) or reference(*a, **k)
    )
    diagnose(
        [tmp_path / "run.csv"], out, [tmp_path / "judge.csv"], str(tmp_path / "machine.toml"),
        tmp_path / "my_bow.py", 1,
    )  # fmt: skip
    said = capsys.readouterr().err.splitlines()
    assert said[0].startswith("no C compiler: what the cache does not hold runs in Python")
    assert said[-1] == f"CoreXY.fmu was not built: {compiler.MISSING}"
    assert {path.name for path in out.iterdir()} == {
        "report.html",
        "diagnosis.json",
        "machine.toml",
    }
    document = json.loads((out / "diagnosis.json").read_text())
    seen = {e["name"] for e in [*document["effects"], *document["not_excluded"]]}
    assert {"my_bow", "sensor_delay"} <= seen
    assert len(slowly) > 10
