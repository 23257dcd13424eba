"""docs/sweep.md holds the figures that are stored, and works them out rightly."""

import pytest

from benchmarks.sweep_page import PAGE, ceiling, fastest, outcome, rendered


def test_the_page_is_fresh():
    assert PAGE.read_text(encoding="utf-8") == rendered()


def test_the_ceiling_is_one_chunk_over_its_cost():
    assert ceiling({"sets": 1000, "write": 0.003, "hand_over": 0.001}) == pytest.approx(250_000)


@pytest.mark.parametrize(
    ("cores", "sets", "seconds"),
    [
        (1, 10_000, 10 + 0.002),  # ten chunks one after the other, the last one collected
        (4, 10_000, 3 + 0.002),  # three rounds of a second
        (1000, 10_000, 1 + 0.002),  # no chunk is split
        (1000, 10_000_000, 20.0),  # the collector takes 500 chunks a second, no more
    ],
)
def test_the_estimate_is_rounds_or_the_collector(cores, sets, seconds):
    row = {"sets": 1000, "write": 0.0015, "hand_over": 0.0005}
    assert fastest({"collecting": [row]}, 1000.0, cores, sets) == (pytest.approx(seconds), 1000)


def test_the_figures_are_of_this_command():
    found = outcome()
    assert found["command"] == "python -m benchmarks.sweep"
    assert [row["cores"] for row in found["sweeps"]] == [1, 2]
