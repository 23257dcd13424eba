"""The study of intervals under looser priors: what it asks, and what it tells."""

from benchmarks.concealed import calibration, loose


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
