"""The studies of intervals, under looser priors and walked: what they ask, and what they tell."""

import json
from pathlib import Path

from benchmarks import walked
from benchmarks.concealed import calibration, loose

ROOT = Path(__file__).parents[1]


def row(before, after, wider):
    return {"parameter": "gap", "inside": [before, after], "wider": wider}


def test_what_came_out_in_a_line():
    rows = [[row(True, True, 1.0)], [row(False, True, 1.5), row(False, False, 1.2)]]
    told = loose.told([{"name": str(n), "rows": r} for n, r in enumerate(rows)])
    assert told.startswith("2 cases, 3 parameters: inside 1 with the file's priors, 2 with looser")
    assert "1.20 in the median" in told


def test_cases_that_missed_come_first_and_as_many_others_follow():
    cases = loose.chosen()
    held = [all(all(v) for v in calibration.coverage([case]).values()) for case in cases]
    missed = held.count(False)
    assert missed > 10
    assert held == [False] * missed + [True] * missed
    assert all(calibration.in_own_form(case) for case in cases)


def test_the_page_says_how_often_walked_intervals_hold():
    stored = json.loads((ROOT / "benchmarks" / "results" / "walked.json").read_text("utf-8"))
    told = walked.told(stored["rows"])
    assert told == stored["told"]
    fits = [row for row in stored["rows"] if "taken" in row]
    each = [p for row in fits for p in row["parameters"]]
    held = [sum(p["inside"][k] for p in each) for k in range(3)]
    page = " ".join((ROOT / "docs" / "engine.md").read_text("utf-8").split())
    assert (
        f"Of {len(each)} intervals that were walked in {len(fits)} fits, of every effect with such "
        f"a parameter, {held[0]} hold the truth by curvature, {held[1]} under looser priors, "
        f"{held[2]} as walked"
    ) in page
