"""The measured cost of inputs: the documents show what the results file holds."""

from __future__ import annotations

import json

import pytest
from fmu_kit import machine, template

from benchmarks import fmu_inputs
from corexy_fmi.fmu.archive import read_archive
from corexy_fmi.fmu.document import cost_rows, measured_inputs


def test_documents_show_the_measured_table() -> None:
    """docs/fmu.md and the page inside the FMU are rendered from the results."""
    document = json.loads(fmu_inputs.RESULT.read_text(encoding="utf-8"))
    assert document == measured_inputs()
    page = fmu_inputs.DOCUMENT.read_text(encoding="utf-8")
    assert fmu_inputs.table(document) in page
    inside = read_archive(template())["documentation/index.html"].decode()
    assert document["caption"] in inside
    for row in cost_rows(document)[1:]:
        assert "".join(f"<td>{cell}</td>" for cell in row) in inside


def test_angles_with_rates_stay_within_a_micrometre() -> None:
    """In the results, for every step."""
    rows = json.loads(fmu_inputs.RESULT.read_text(encoding="utf-8"))["rows"]
    assert [row["step_ms"] for row in rows] == [0.5, 1.0, 2.0, 7.0]
    assert max(row["ramped_um"] for row in rows) < 1.0


def test_a_held_angle_lags_by_half_a_step() -> None:
    """What the table says about held angles, measured again at one step."""
    held = fmu_inputs.worst(template(), machine(), 7e-3, ramped=False, off_grid=False)
    assert held == pytest.approx(1e6 * fmu_inputs.SPEED * 7e-3 / 2, rel=0.05)
