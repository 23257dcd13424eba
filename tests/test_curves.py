"""What RESULTS.md says of struck entries' curves."""

from __future__ import annotations

from benchmarks.concealed import curves
from benchmarks.concealed.cases import CATALOGUES


def outcome(
    error: float | None,
    verdict: str,
    coordinate: str,
    commit: str = "abc",
    near: float = 300.0,
    reached: float = 400.0,
) -> dict:
    """One case as it is kept."""
    planted = [{"name": "cable_drag", "location": "y", "parameters": {}}]
    law = {"location": "y", "argument": "y", "knots": [0, 1], "values": [0, 1]}
    return {
        "name": "struck-cable_drag-0",
        "seed": 1,
        "origin": "abc",
        "commit": commit,
        "reached": {"retuned": 990.0, "explained": reached},
        "outcome": "wrong" if verdict == "explained" else "abstained",
        "truth": {"kind": "effect", "effects": planted, "E": 990.0, "E_sep": near},
        "document": {
            "verdict": verdict,
            "located": {"coordinate": coordinate, "state": "position"},
        },
        "laws": [law] if error is not None else [],
        "curve_error": error,
    }


def test_the_section_counts_near_laws_right_places_and_wrong_names():
    said = [
        outcome(0.1, "unexplained", "y"),
        outcome(0.4, "unexplained", "x", "def"),
        outcome(None, "explained", "sensor"),
        outcome(None, "explained", "y", near=20.0),
        outcome(None, "explained", "y", reached=30.0),
    ]
    page = " ".join(curves.section(said))
    assert "misnamed: 3/5 = 60.0 %" in page
    assert "(E_sep >= 100) 2/4 = 50.0 %" in page
    assert "stand for one) 1/3 = 33.3 %" in page
    assert "right coordinate: 1/4 = 25.0 %" in page
    assert "1/2 = 50.0 % [9.5, 90.5] within it, median 0.25" in page
    assert "One engine ran all" not in page
    assert "One engine ran all" in " ".join(curves.section(said[:1]))
    assert "| struck-cable_drag-0 | y | 990 | 300 | explained | - | - |" in page
    assert curves.section([]) == []
    anew = curves.section(said, "anew")
    assert anew[0].endswith("entry, anew")
    assert "benchmarks.concealed.curves --round anew`" in anew[2]


def test_the_cases_are_sealed_ones_of_axial_causes_in_turn():
    cases = curves.cases()
    assert set(curves.AXIAL) < set(CATALOGUES["full"])
    assert len({name for name, _ in cases}) == len(cases) == curves.REPEATS * len(curves.AXIAL)
    assert {wanted["effect"] for _, wanted in cases[: len(curves.AXIAL)]} == set(curves.AXIAL)
    assert all(wanted["target_E"] == curves.TARGET for _, wanted in cases)
