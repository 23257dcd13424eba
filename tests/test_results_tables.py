"""RESULTS.md: what is removed of the error kept back, and the rows of struck entries."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.concealed import distances, render, tables
from benchmarks.concealed.held import removed


def trace(role: str, explained: float, retuned: float) -> SimpleNamespace:
    """A recording whose models are off the truth by sines of these sizes, and by an offset."""
    time = np.arange(1000) * 1e-3
    truth, wave = np.sin(20 * time), np.sin(2 * np.pi * 5 * time)
    states = {"explained": explained, "retuned": retuned}
    models = {s: dict.fromkeys("xy", truth + a * wave + 0.3) for s, a in states.items()}
    measured = np.where(np.arange(1000) % 10, np.nan, truth)  # every tenth row is a sample
    return SimpleNamespace(
        recording=f"{role}.csv",
        time=time,
        measured=dict.fromkeys("xy", measured),
        **models,
        truth=dict.fromkeys("xy", truth),
    )


def test_what_is_removed_is_the_share_of_the_squared_distance_to_the_truth() -> None:
    train, kept = trace("train", 1.0, 1.0), trace("holdout", 0.1, 1.0)
    found: Any = SimpleNamespace(evidence=SimpleNamespace(traces=(train, kept)))
    world = SimpleNamespace(zeroed=False)
    case = SimpleNamespace(holdout_clean={"holdout.csv": kept.truth}, world=world)
    assert removed(case, found) == pytest.approx(0.99)
    assert removed(SimpleNamespace(holdout_clean={}), found) is None


def entry(verdict: str, coordinate: str, apart: float, curve: float | None) -> dict[str, Any]:
    return {
        "outcome": "right",
        "removed": 0.9 if curve is None else 1.0,
        "truth": {"kind": "effect", "E": 900.0, "E_sep": apart, "effects": [{"location": "xy"}]},
        "struck": {"verdict": verdict, "coordinate": coordinate, "curve_error": curve},
    }


ENTRIES = [
    entry("unexplained", "x", 500.0, 0.1),
    entry("unexplained", "motor1", 500.0, 0.3),
    entry("explained", "belts", 20.0, None),
]


def test_struck_entries_count_apart_where_a_near_twin_is_left() -> None:
    rows = [value for _, _, value in tables.struck(ENTRIES)]
    assert [value.split(" ")[0] for value in rows] == ["1/3", "0/2", "no", "2/2", "1/2", "1"]
    assert rows[-1] == "1 of 2 within 0.2: 0.10, 0.30"


def test_what_comes_near_a_struck_truth_is_its_twin_whatever_the_plant_says() -> None:
    said = [("explained", 40.0), ("explained", 200.0), ("unexplained", 5.0)]
    struck = [entry(verdict, "belts", 500.0, None) for verdict, _ in said]
    for e, (_, reached) in zip(struck, said, strict=True):
        e["struck"]["reached"] = reached
    rows = [value for _, _, value in tables.struck(struck)]
    assert [value.split(" ")[0] for value in rows[1:3]] == ["2/3", "1/2"]


def test_what_the_latest_struck_cases_say_stands_behind_all() -> None:
    named = [e | {"name": "a", "seed": 1} for e in ENTRIES]
    rows = [r for r in tables.levels(named, "none", "", ENTRIES[:1]) if "coordinate" in r]
    assert "1/2 = 50.0 %" in rows[0]
    assert "; the latest 1: 1/1 = 100.0 %" in rows[0]


def test_a_class_with_the_truth_in_it_counts_half_where_effects_are_weak() -> None:
    truth = {"kind": "effect", "E": 300.0, "E_sep": 20.0, "effects": [{"location": "x"}]}
    weak = [{"outcome": o, "truth": truth} for o in ("right", "class", "class", "class", "wrong")]
    weak.append({"outcome": "missed", "truth": {**truth, "E_sep": 200.0}})
    said = [row.split(" | ")[2].split(" =")[0] for row in tables.headline(weak)[4:8]]
    assert said == ["1/6", "0/1", "2/6", "4/6"]


def test_the_latest_cases_stand_beside_all() -> None:
    first, _, row, *_ = tables.headline(ENTRIES, tables.FULL_AIMS, ENTRIES[-1:])
    assert first.endswith(f"| all {len(ENTRIES)} [Wilson 95 %] | the latest 1 |")
    everything, latest = row.split(" | ")[2:]
    assert everything.startswith(tables.headline(ENTRIES)[2].split(" | ")[2].split(" =")[0])
    assert latest.startswith("no case")


def test_what_is_removed_where_little_was_left_counts_apart() -> None:
    some = [{"retuned": 50.0, "explained": 40.0}, {"retuned": 200.0, "explained": 2.0}]
    (line, _) = distances.removal([ENTRIES[0] | {"kept_back": told} for told in some])
    assert "(n = 2, kept since): median 59.5 %" in line
    assert "(n = 1): median 99.0 %, worst decile 99.0 %" in line


def test_what_is_removed_is_told_with_its_worst_decile() -> None:
    (line, _) = distances.removal(ENTRIES)
    assert "n = 3): median 100.0 %" in line
    assert "worst decile 92.0 %" in line
    assert distances.removal([{**ENTRIES[0], "removed": None}]) == []


def test_what_is_removed_of_all_channels_is_told_beside_it() -> None:
    far = {"retuned": 50.0, "explained": 1.0}
    (line, _) = distances.removal([{**ENTRIES[0], "kept_back": far}, ENTRIES[1]])
    assert "each in its noise (n = 1, kept since): median 98.0 %, worst decile 98.0 %" in line


def test_a_fit_without_the_effect_bounds_what_the_plant_calls_e() -> None:
    pair = [{"name": n, "location": "x"} for n in ("cable_drag", "quadratic_drag")]

    def case(name: str, said: int, planted: int, retuned: float, explained: float) -> Any:
        truth = {"kind": "pair" if planted > 1 else "effect", "E": 1000.0}
        truth["effects"] = pair[:planted]
        reached = {"retuned": retuned, "explained": explained}
        return {
            "name": name,
            "truth": truth,
            "document": {"effects": pair[:said]},
            "reached": reached,
        }

    told = [
        case("a", 1, 1, 990.0, 5.0),  # what was planted is in the second
        case("b", 1, 1, 400.0, 5.0),
        case("c", 1, 2, 9000.0, 30.0),  # one of two explains both
        case("d", 2, 2, 9000.0, 3.0),
    ]
    sentence, *names = distances.overstated(told)
    assert "in 2 of 4 cases" in sentence
    assert "b (1000: 400), c (1000: 30)" in names
    assert distances.overstated([{"truth": {"kind": "effect"}}]) == []


@pytest.mark.parametrize(
    ("effect", "catalogue", "kept", "wrong"),
    [
        ("constant_force", "full", {}, True),  # the plant gives it a known zero
        ("constant_force", "full", {"zeroed": True}, False),
        ("constant_force", "ten", {}, False),  # no zero was known then
        ("backlash", "full", {"seed": 10}, True),
        ("backlash", "full", {"seed": 2}, False),
    ],
)
def test_distances_to_the_truth_of_older_cases_with_a_known_zero_are_left_out(
    effect: str, catalogue: str, kept: dict[str, Any], wrong: bool
) -> None:
    truth = {"catalogue": catalogue, "effects": [{"name": effect, "location": "x"}]}
    case = ENTRIES[0] | {"seed": 2} | kept | {"truth": ENTRIES[0]["truth"] | truth}
    assert distances.misread(case) == wrong
    (line, *_) = distances.removal([ENTRIES[0], case])
    assert ("n = 1)" in line) == ("Left out: 1" in line) == wrong


def test_a_second_round_has_tables_of_its_own() -> None:
    entries = render.outcomes("full")[:70]
    lines = render.again(entries)
    assert "70 sealed cases so far" in lines[2]
    assert lines[4].startswith("| measure | aim | measured")
    assert "### Levels of concealment" in lines
    assert lines[2].endswith("none that was scored was run again.")
    assert render.again(entries[:1])[2].endswith("One engine ran all.")
