"""Thresholds against made-up cases, counted by hand."""

import numpy as np
import pytest

from benchmarks.concealed import thresholds
from corexy_fmi.engine.naming.entries import CEILING, TEMPERATURE


def null(gain):
    return {"truth": {"kind": "null"}, "outcome": "right",
            "document": {"gain": gain, "verdict": "nothing_missing"}}  # fmt: skip


def test_the_maximum_of_a_null_is_never_below_zero():
    effect = {"truth": {"kind": "effect"}, "document": {"gain": 99.0}}
    assert thresholds.null_maxima([null(3.0), null(-2.0), effect]) == [0.0, 3.0]


def test_the_own_temperature_changes_nothing_below_the_ceiling():
    pairs = [(0.6, True), (0.9, False), (1.0, True)]
    told = [p for p, _ in thresholds.tempered(pairs, TEMPERATURE)]
    assert told == pytest.approx([0.6, 0.9, CEILING])
    hotter = [p for p, _ in thresholds.tempered(pairs, 2 * TEMPERATURE)]
    assert hotter[0] == pytest.approx(1 / (1 + (0.4 / 0.6) ** 0.5))


def test_log_loss_by_hand():
    assert thresholds.log_loss([(0.8, True), (0.9, False)]) == pytest.approx(
        -(np.log(0.8) + np.log(0.1)) / 2
    )


def test_a_diagram_is_the_same_bytes_each_time(tmp_path):
    pairs = [(0.6, True), (0.7, False), (0.99, True)]
    for name in ("a.svg", "b.svg"):
        thresholds.diagram(pairs, pairs, tmp_path / name)
    one, other = ((tmp_path / n).read_bytes() for n in ("a.svg", "b.svg"))
    assert one == other
