"""The stage in MuJoCo: near the kernel without a mechanism, near the right effect with one."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.mechanism import page, store
from benchmarks.mechanism.mechanisms import MECHANISMS, described
from benchmarks.mechanism.mjcf import Parts, model_text
from benchmarks.mechanism.run import ROW, accelerations
from corexy_fmi.effects import catalogue
from corexy_fmi.kernel.call import Excitation, run_lanes
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse, load_machine
from corexy_fmi.simulate import machine_vector

MACHINE = load_machine("yin2018")
SOME = pytest.mark.parametrize("name", MECHANISMS)
# share that its effect may leave (play: contact, a mass in the gap; the frame does little here)
LEFT = {"play": 0.1, "frame": 0.2}


def strokes() -> np.ndarray:
    """Motor angles (rows, 2) [rad] of 0.6 s to and fro, both axes."""
    time = np.arange(600) * ROW
    path = 0.006 * np.column_stack([np.sin(6 * time), 1.2 * np.sin(9 * time)])
    return np.column_stack([path.sum(axis=1), path[:, 0] - path[:, 1]]) / 0.005


def kernel(effects: tuple[EffectUse, ...]) -> np.ndarray:
    phi, layout = strokes(), bundled_layout()
    drive = Excitation(np.arange(len(phi)) * ROW, *np.ascontiguousarray(phi.T))
    vector = machine_vector(replace(MACHINE, effects=effects), layout)
    return run_lanes(layout, drive, vector[None])[0].T


def mujoco(parts: Parts, count: int = 20) -> np.ndarray:
    pytest.importorskip("mujoco", reason="mujoco is not installed: pip install '.[peers]'")
    from benchmarks.mechanism.run import mujoco_run

    return mujoco_run(MACHINE.parameters, strokes(), parts, count)


def spread(off: np.ndarray) -> float:
    return float(np.sqrt(np.mean(off[100:] ** 2)))


@SOME
def test_a_mechanism_is_named_as_the_catalogue_does(name: str) -> None:
    realised = MECHANISMS[name].draw(np.random.default_rng(3), MACHINE.parameters)
    said = described(name, realised)
    effect = catalogue()[said["name"]]
    assert said["location"] in effect.locations
    assert set(said["parameters"]) <= {p.name for p in effect.parameters}
    ElementTree.fromstring(model_text(MACHINE.parameters, realised.parts, 5e-5, "Euler"))


def test_belts_of_unequal_stiffness_keep_their_mean() -> None:
    def stiffness(ratio: float) -> np.ndarray:
        text = model_text(MACHINE.parameters, Parts(ratio=ratio), 5e-5, "Euler")
        return np.array(
            [float(t.get("stiffness", "")) for t in ElementTree.fromstring(text).iter("fixed")]
        )

    changed = stiffness(0.5)
    assert changed[:6] == pytest.approx(1.5 * changed[6:])
    assert changed[:6] + changed[6:] == pytest.approx(2 * stiffness(0.0)[:6])


def test_rotors_are_driven_to_every_row() -> None:
    phi, count = strokes(), 4
    rates = np.cumsum(accelerations(phi, count), axis=0) * ROW / count
    travelled = np.cumsum(rates, axis=0)[count - 1 :: count] * ROW / count
    assert travelled == pytest.approx(phi[1:] - phi[0], abs=1e-12)


def test_without_a_mechanism_it_nears_the_kernel_as_its_step_shrinks() -> None:
    coarse, fine = (np.abs(mujoco(Parts(), n) - kernel(())).max() for n in (20, 60))
    assert coarse < 1e-6
    assert fine < 0.45 * coarse


@SOME
def test_a_mechanism_does_what_its_effect_does(name: str) -> None:
    realised = MECHANISMS[name].draw(np.random.default_rng(5), MACHINE.parameters)
    said = described(name, realised)
    use = EffectUse(said["name"], said["location"], said["parameters"])
    theirs = mujoco(realised.parts)
    does, left = spread(theirs - kernel(())), spread(theirs - kernel((use,)))
    assert does > 0.5e-6
    assert left < LEFT.get(name, 0.05) * does


def test_results_are_added_to(tmp_path: Path) -> None:
    path = tmp_path / "kept.json"
    store.keep("agreement", [1], path)
    store.append("cases", {"name": "a"}, path)
    store.append("cases", {"name": "b"}, path)
    assert store.read(path) == {"agreement": [1], "cases": [{"name": "a"}, {"name": "b"}]}


def entry(name: str, kind: str, outcome: str, origin: str = "b" * 40) -> dict[str, object]:
    held = dict.fromkeys(("rms_nominal", "rms_retuned", "rms_explained"), 1e-5)
    effect = {"name": "racking", "location": "bridge"}
    truth = {"kind": kind, "effects": [effect] * (kind == "effect"), "size": "s", "base": "yin2018"}
    truth["noise"] = {"sigma": 1e-5, "rho": 0.0}
    said = {"verdict": "explained", "effects": [effect], "heldout": held}
    times = {"diagnose": 60.0}
    return {"name": name, "truth": truth, "outcome": outcome, "document": said,
            "seconds": times, "commit": origin, "origin": origin}  # fmt: skip


def test_the_section_counts_and_drops_nothing() -> None:
    before = entry("yaw-0", "effect", "wrong", "a" * 40)
    cases = [before, entry("yaw-0", "effect", "right"), entry("null-0", "null", "false_alarm")]
    seals = [{"name": n, "origin": "b" * 40} for n in ("yaw-0", "null-0", "tool-0")]
    text = "\n".join(page.section({"cases": cases, "seals": seals}))
    newest, earlier = text.index(f"Engine {'b' * 12}"), text.index(f"Engine {'a' * 12}")
    assert "1 mechanisms: 1 right. 1 nulls: 1 false_alarm." in text[newest:earlier]
    assert "cut off by the clock: tool-0" in text[newest:earlier]
    assert "1 mechanisms: 1 wrong. 0 nulls: none run." in text[earlier:]
    assert page.section({}) == []
