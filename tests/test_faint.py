"""Bounds on what was planted and not found, and what RESULTS.md says of effects out of reach."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.concealed import faint, proof
from benchmarks.concealed.bounds import bounded


def planted(name: str, place: str, **values: float) -> dict[str, Any]:
    return {"effects": [{"name": name, "location": place, "parameters": values}]}


def bound(name: str, place: str, upper: float) -> dict[str, Any]:
    return {"not_excluded": [{"name": name, "location": place, "upper95": upper}]}


@pytest.mark.parametrize(
    ("name", "place", "values", "upper", "holds"),
    [
        ("constant_force", "x", {"force": -0.4}, 0.5, True),  # by its size, whatever its sign
        ("constant_force", "x", {"force": -0.6}, 0.5, False),
        ("stepper_compliance", "motors", {"holding_torque": 4.0, "damping": 0.1}, 0.3, True),
        ("stepper_compliance", "motors", {"holding_torque": 2.0, "damping": 0.1}, 0.3, False),
        ("stribeck_friction", "x", {"static_ratio": 1.2}, 1.3, True),  # from its neutral 1
        ("stribeck_friction", "x", {"static_ratio": 1.4}, 1.3, False),
        ("belt_mismatch", "belts", {"ratio": -0.1}, 0.15, True),
    ],
)
def test_a_bound_holds_what_is_weaker(name, place, values, upper, holds):
    (row,) = bounded(bound(name, place, upper), planted(name, place, **values))
    assert row["holds"] is holds
    assert (row["effect"], row["location"]) == (name, place)


def test_what_has_no_bound_or_no_size_of_its_own_is_left_out():
    truth = planted("constant_force", "x", force=0.4)
    assert bounded(bound("constant_force", "y", 0.5), truth) == []
    several = planted("missed_steps", "motor1")
    assert bounded(bound("missed_steps", "motor1", 2.0), several) == []


def case(n: int, outcome: str, size: float, **kept: Any) -> dict[str, Any]:
    truth = {"kind": "effect", "E": size, "E_sep": size}
    return {"name": f"seed-{n}", "seed": n, "truth": truth, "outcome": outcome} | kept


def test_effects_out_of_reach_are_told_apart(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(proof, "RESULTS", tmp_path)
    yes, no = [{"holds": True}], [{"holds": False}]
    entries = [
        case(1, "missed", 400.0),  # in reach
        case(2, "class", 50.0),
        case(3, "abstained", 60.0),
        case(4, "missed", 20.0, bounds=yes),
        case(5, "missed", 20.0, bounds=no),
        case(6, "missed", 20.0),  # run again: its bound holds
        case(7, "missed", 20.0),  # run again: found by now
        case(8, "missed", 20.0),  # not run again yet
    ]
    again = [
        {"name": "seed-6:6", "outcome": "missed", "bounds": yes},
        {"name": "seed-7:7", "outcome": "right", "bounds": []},
    ]
    text = "".join(json.dumps(e) + "\n" for e in again)
    (tmp_path / "faint.0.jsonl").write_text(text, encoding="utf-8")
    (line, _) = faint.section(entries)
    assert "7 single effects, of which named or in a class 1, left open otherwise 1" in line
    assert "nothing missing 5" in line
    assert "1 are found by now" in line
    assert "holds it in 2/3 = 66.7 %" in line
    assert faint.section(entries[:1]) == []
    text = "".join(json.dumps(e) + "\n" for e in entries)
    (tmp_path / "later.0.jsonl").write_text(text, encoding="utf-8")
    assert [name for name, _ in faint.unbounded()] == ["seed-6:6", "seed-7:7", "seed-8:8"]
