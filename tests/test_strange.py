"""Machines drawn from a seed: what is drawn, its files, its grades, results on the disk."""

import ast
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from strange_kit import short_recordings

from benchmarks.shop import grade
from benchmarks.shop.case import HOLDOUT, TRAIN
from benchmarks.strange import __main__ as strange
from benchmarks.strange import draw, files, machines, moves, page, running, sensing, sizes, store
from benchmarks.strange.cause import About
from benchmarks.strange.dc_causes import DC_CAUSES
from benchmarks.strange.rest_causes import REST
from corexy_fmi.effects import catalogue
from corexy_fmi.machine import load_machine
from corexy_fmi.recording import read_recording

FOLDER = Path(draw.__file__).parent
SEEDS = range(40)
NULL, SMALL = 1, 15  # seeds: nothing concealed, and a cause
PLAY = {"effect": "backlash", "location": "motor1", "parameters": {"gap": 0.02}, "E0": 5e3}
NOTHING = {"effect": None, "location": None, "parameters": {}, "E0": 0.0}


@pytest.fixture(scope="module")
def short():
    with short_recordings():
        yield


@pytest.fixture(scope="module")
def case(short):
    return draw.draw(SMALL)


@pytest.fixture(scope="module")
def healthy(short):
    return draw.draw(NULL)


def machine_of(seed):
    return machines.draw_machine(draw.generator(seed, 0))


def about(seed):
    """A machine and short motions for it."""
    machine, random = machine_of(seed), draw.generator(seed, 2)
    kinds = "scattered", "rectangles", "zigzag"
    cut = [moves.draw_motion(random, machine, kind, 2e-3) for kind in kinds]
    return About(machine, [(time[:600], xy[:600]) for time, xy in cut])


def test_machines_are_within_their_ranges():
    for seed in SEEDS:
        machine = machine_of(seed)
        n, (omega, damping, fastest) = machine.numbers, machine.modes
        for name, (low, high) in machines.RANGES.items():
            assert low <= n[name] <= high
        assert 600 <= n["AE"] <= 20e3
        assert 5e-8 <= n["Jp"] <= 2e-6
        assert all(0.1 <= n[name] <= 3 for name in ("fx", "fy"))
        assert all(n[name] > 0 for name in ("bx", "by", "Bp", "tf"))
        assert 8 <= omega.min() / (2 * np.pi) <= omega.max() / (2 * np.pi) <= 90
        assert 10 <= omega[1] / (2 * np.pi) <= 70
        assert damping == pytest.approx(np.clip(damping, 0.03, 0.5))
        assert machine.step(loose=False) * fastest <= machines.RESOLVED
        assert machine.half[0] <= 0.35 * n["W"]
        assert machine.half[1] == 0.35 * n["H"]


def test_motions_are_within_what_the_machine_can_follow():
    for seed in SEEDS:
        machine = machine_of(seed)
        fastest, hardest = moves.limits(machine)
        for time, xy in moves.draw_motions(draw.generator(seed, 2), machine, 2e-3):
            speed = np.diff(xy, axis=0) / 2e-3
            gain = np.diff(speed, axis=0) / 2e-3
            assert 6 <= time[-1] <= 14
            assert (np.abs(xy) <= np.array(machine.half) + 1e-12).all()
            assert np.hypot(*speed.T).max() <= fastest + 1e-9 <= 0.5 + 2e-9
            assert np.hypot(*gain.T).max() <= 2 * hardest <= 16  # two moves may meet in a row
            assert np.ptp(xy, axis=0).min() > 5e-3


def test_sensors_are_within_their_ranges():
    drawn = [sensing.draw_sensor(draw.generator(seed, 1)) for seed in range(300)]
    for sensor in drawn:
        assert 1e-3 <= sensor.row <= 5e-3
        assert 99 <= 1 / (sensor.row * sensor.every) <= 1001
        assert 3e-6 <= sensor.std <= 40e-6
    for share, wanted in (
        ([s.rho > 0 for s in drawn], sensing.COLOURED),
        ([s.count > 0 for s in drawn], sensing.STEPPED),
        ([s.offsets is None for s in drawn], sensing.ZEROED),
    ):
        assert np.mean(share) == pytest.approx(wanted, abs=0.08)


@pytest.mark.parametrize(("rho", "count"), [(0.0, 0.0), (0.8, 0.0), (0.6, 1e-5)])
def test_the_noise_of_a_sensor_is_white_and_of_size_1_once_whitened(rho, count):
    sensor = sensing.Sensor(1e-3, 1, 1e-5, rho, count, None)
    place = np.random.default_rng(1).uniform(-1e-3, 1e-3, 2)
    seen = sensor.seen(np.tile(place, (20000, 1)), np.random.default_rng(0)) - place
    white = sensor.whitened(seen)
    assert white.std() == pytest.approx(1.0, abs=0.08)
    assert np.corrcoef(white[1:, 0], white[:-1, 0])[0, 1] == pytest.approx(0.0, abs=0.05)


def test_a_change_in_the_mean_shows_only_beside_a_known_zero():
    change = np.full((100, 2), 1e-3)
    blind = sensing.Sensor(1e-3, 1, 1e-5, 0.0, 0.0, np.zeros((3, 2)))
    assert np.abs(blind.whitened(change)).max() < 1e-9
    assert replace(blind, offsets=None).whitened(change) == pytest.approx(100.0)


def test_every_cause_is_one_of_the_catalogue_within_its_bounds():
    known, here, names = catalogue(), about(0), set()
    for draws in sizes.CAUSES:
        cause = draws(np.random.default_rng(3), here)
        names.add(cause.name)
        effect = known[cause.name]
        bounds = {p.name: (p.lower, p.upper) for p in effect.parameters}
        assert cause.location in effect.locations
        for size in cause.bounds:
            for name, value in cause.parameters(size).items():
                low, high = bounds[name.partition("@")[0]]
                assert low <= value <= high, (cause.name, name)
    assert len(names) == len(sizes.CAUSES) == 15


def test_all_rounds_together_conceal_every_effect_of_the_catalogue():
    drawn = (*sizes.CAUSES, *DC_CAUSES, *REST)
    assert {draws.__name__.removeprefix("_") for draws in drawn} == set(catalogue())


def test_every_cause_changes_what_is_seen():
    here = about(5)
    well = running.moved(here.machine, 0, here.motions[0], running.HEALTHY)
    for draws in sizes.CAUSES:
        cause = draws(np.random.default_rng(1), here)
        acts = cause.acts(round(cause.bounds[1] / 4) if cause.whole else cause.bounds[1] / 4)
        seen = running.moved(here.machine, 0, here.motions[0], acts)
        assert np.isfinite(seen).all()
        if cause.name not in ("missed_steps", "friction_vs_position"):  # later, or elsewhere
            assert np.abs(seen - well).max() > 1e-6, cause.name


@pytest.mark.parametrize("seed", [0, 5, 22])
def test_half_the_step_changes_less_than_half_a_micron(seed):
    here = about(seed)
    backlash = next(d for d in sizes.CAUSES if d.__name__ == "_backlash")
    for acts in (running.HEALTHY, backlash(np.random.default_rng(seed), here).acts(0.02)):
        one, half = (running.moved(here.machine, 0, here.motions[0], acts, finer=k) for k in (1, 2))
        assert np.abs(one - half).max() < 5e-7


def test_the_size_is_found_or_its_bound_kept():
    here = about(0)
    draws = next(d for d in sizes.CAUSES if d.__name__ == "_axis_skew")
    cause = draws(np.random.default_rng(0), here)
    angle = lambda acts: 1e9 * acts.shown(0, np.zeros(1), np.ones((1, 2)))[0, 0]  # noqa: E731

    def squares(acts):
        return (angle(acts) - 1e9) ** 2 / 1e9

    found = sizes.sized(cause, 1e5, squares)
    assert found.evidence == pytest.approx(1e5, rel=0.3)
    assert found.evidence == squares(found.acts)
    assert sizes.sized(cause, 1e30, squares).size == cause.bounds[1]


def test_a_case_is_the_same_each_time(case, healthy, tmp_path):
    for folder, one in (("a", case), ("b", draw.draw(SMALL))):
        files.write(one, tmp_path / folder)
        assert files.seal(one, tmp_path / folder) == files.seal(case, tmp_path / "a")
    for name in files.FILES:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert healthy.truth == NOTHING
    assert case.truth["E0"] >= sizes.FAINT


def test_the_package_reads_the_files(case, tmp_path):
    files.write(case, tmp_path)
    told, true = load_machine(tmp_path / files.MACHINE).parameters, case.machine.numbers
    for name, long in machines.GEOMETRY.items():
        assert told[long] == true[name]
    for name, long in machines.UNSURE.items():
        assert 0.5 < told[long] / true[name] < 2
        assert told[long] != true[name]
    for name, table in zip(TRAIN + HOLDOUT, case.tables, strict=True):
        recording = read_recording(tmp_path / name)
        assert ("zero" in recording.metadata) == (case.sensor.offsets is None)
        taken = np.flatnonzero(np.isfinite(recording["x"]))
        assert taken.tolist() == list(range(0, len(recording.time), case.sensor.every))
        assert np.array_equal(recording["phi1"], table["phi1"])


def test_nothing_that_makes_cases_is_the_packages():
    tellers = {"__main__", "page", "store"}
    for path in FOLDER.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            modules += [a.name for a in node.names] if isinstance(node, ast.Import) else []
            for module in modules if path.stem not in tellers else []:
                other = r"corexy_fmi|plant|benchmarks(?!\.(shop|strange))"
                assert not re.match(other, module), (path, module)


def said(verdict, *effects, place=None, classes=()):
    named = [{"name": name, "location": where} for name, where in effects]
    return {"verdict": verdict, "effects": named, "coordinate": place,
            "ambiguous_between": classes, "ambiguous_sets": []}  # fmt: skip


OPEN = [[{"name": "backlash", "location": "motor1"}, {"name": "sensor_lag", "location": "sensor"}]]


@pytest.mark.parametrize("seed", [1, 4])
def test_two_causes_are_of_different_kinds_and_both_act(seed):
    case = draw.draw(seed, two=True)
    names = [one.cause.name for one in case.found]
    kinds = [
        next(k for k, kind in enumerate(sizes.KINDS) if f"_{name}" in {d.__name__ for d in kind})
        for name in names
    ]
    assert kinds == sorted(set(kinds))
    assert len(kinds) == 2
    assert [one["effect"] for one in case.truth["effects"]] == names
    assert case.truth["E0"] == min(one.evidence for one in case.found)
    seen = [
        running.moved(case.machine, 0, case.motions[0], acts)
        for acts in (*(one.acts for one in case.found), running.both(*(o.acts for o in case.found)))
    ]
    assert all(np.abs(seen[2] - one).max() > 1e-6 for one in seen[:2])
    assert draw.truth_of(case.truth).causes == (frozenset(
        (one.cause.name, one.cause.location) for one in case.found
    ),)  # fmt: skip


@pytest.mark.parametrize(
    ("truth", "told", "mark"),
    [
        (NOTHING, said("nothing_missing"), grade.RIGHT),
        (NOTHING, said("unexplained", place="x"), grade.ALARM),
        (NOTHING, said("explained", ("backlash", "motor1")), grade.WRONG),
        (PLAY, said("explained", ("backlash", "motor1")), grade.RIGHT),
        (PLAY, said("explained", ("backlash", "motor2")), grade.WRONG),
        (PLAY, said("ambiguous", ("sensor_lag", "sensor"), classes=OPEN), page.CLASS),
        (PLAY, said("unexplained", place="motor1"), grade.PLACE),
        (PLAY, said("unexplained", place="y"), grade.ABSTAINED),
        (PLAY, said("nothing_missing"), grade.MISSED),
    ],
)
def test_grades(truth, told, mark):
    assert page.marked(truth, told) == mark


def test_the_page_is_fresh():
    text = page.PAGE.read_text(encoding="utf-8")
    assert page.rendered(store.stored(), text, store.evidences()) == text


@pytest.fixture
def aside(healthy, tmp_path, monkeypatch):
    """Results and page in a folder of their own; one case for all; the engine says one thing."""
    (tmp_path / "strange.md").write_text(f"head\n\n{page.BEGIN}\nold\n{page.END}\ntail\n")
    monkeypatch.setattr(store, "FOLDER", tmp_path)
    monkeypatch.setattr(page, "PAGE", tmp_path / "strange.md")
    monkeypatch.setattr(strange, "drawn", lambda number, seed: replace(healthy, seed=seed))
    monkeypatch.setattr(strange, "ask", lambda *of: said("nothing_missing"))
    return tmp_path


def call(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["strange", *words])
    return strange.main()


def test_what_is_there_is_not_run_again(aside, monkeypatch):
    assert call(monkeypatch, "--count", "3", "--shard", "0/2", "--origin", "a") == 0
    assert call(monkeypatch, "--count", "3", "--origin", "a") == 0
    assert call(monkeypatch, "--count", "1", "--origin", "b") == 0
    parts = [store.read(aside / name) for name in ("strange.0.jsonl", "strange.jsonl")]
    assert [[(e["origin"], e["number"]) for e in part] for part in parts] == [
        [("a", 0), ("a", 2)], [("a", 1), ("b", 0)]]  # fmt: skip
    text = (aside / "strange.md").read_text()
    assert "Origin a, 3 cases" in text
    assert "| nothing | right | 3/3 = 100.0 %" in text
    assert text.endswith(f"{page.END}\ntail\n")
    seals = [json.loads(line) for line in (aside / "strange.seals.jsonl").read_text().splitlines()]
    assert [s["seal"] for s in seals] == [e["seal"] for e in parts[1]]


def test_an_interrupt_leaves_a_seal_and_no_half_result(aside, monkeypatch):
    def stopped(*of):
        raise KeyboardInterrupt

    assert call(monkeypatch, "--count", "1", "--origin", "a") == 0
    monkeypatch.setattr(strange, "ask", stopped)
    assert call(monkeypatch, "--count", "2", "--origin", "a") == 130
    assert [e["number"] for e in store.stored()] == [0]
    assert len((aside / "strange.seals.jsonl").read_text().splitlines()) == 2
    assert not list(aside.glob("*.new"))


def test_a_case_can_be_looked_at(aside, monkeypatch):
    assert call(monkeypatch, "--write", "4", str(aside / "looked"), "--origin", "a") == 0
    written = {path.name for path in (aside / "looked").iterdir()}
    assert written == {*files.FILES, files.MACHINE, "truth.json"}
