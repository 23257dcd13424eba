"""The measured cost of inputs: the documents show what the results file holds."""

from __future__ import annotations

import json

import pytest
from fmu_kit import machine, template

from benchmarks import fmu_corners, fmu_inputs
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


def test_the_page_shows_what_ramps_do_to_corners() -> None:
    """A ramp keeps the corners that rates give, to 0.2 um; held angles bend them more and more."""
    document = json.loads(fmu_corners.RESULT.read_text(encoding="utf-8"))
    assert fmu_corners.table(document) in fmu_corners.DOCUMENT.read_text(encoding="utf-8")
    assert [row["step_ms"] for row in document["rows"]] == [1e3 * s for s in fmu_corners.STEPS]
    for row in document["rows"]:
        assert row["ramp_um"] == pytest.approx(row["rates_um"], abs=0.01)
        assert row["ramp_um"] < 0.2
        assert row["hold_um"] > 1.0


def test_a_ramped_corner_is_measured_again() -> None:
    """At one step."""
    rows = json.loads(fmu_corners.RESULT.read_text(encoding="utf-8"))["rows"]
    for mode in ("hold", "ramp"):
        found = fmu_corners.shift(template(), machine(), 7e-3, mode)
        assert found == pytest.approx(rows[-1][f"{mode}_um"], rel=0.01, abs=0.01)
