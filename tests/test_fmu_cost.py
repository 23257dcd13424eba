"""The measured cost of a step: the page shows it, and what was timed moves alike."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from fmu_kit import template

from benchmarks import fmu_cost
from corexy_fmi.fmu.archive import extract_archive


def kept() -> dict[str, dict[str, float]]:
    """The result of the last run."""
    found: dict[str, dict[str, float]] = json.loads(fmu_cost.RESULT.read_text(encoding="utf-8"))
    return found


def test_the_page_shows_the_measured_cost() -> None:
    """The tables are rendered from the results."""
    document = kept()
    assert fmu_cost.table(document) in fmu_cost.DOCUMENT.read_text(encoding="utf-8")
    assert document["ratios"] == fmu_cost.ratios(document["ns"])  # type: ignore[arg-type]
    assert set(document["ns"]) == set(fmu_cost.NAMES)


def test_the_numpy_slave_takes_the_fmus_micro_steps(tmp_path: Path) -> None:
    """Same equations, same steps: the same place after a triangle and a half."""
    extract_archive(fmu_cost.numpy_fmu(tmp_path), tmp_path / "numpy")
    extract_archive(template(), tmp_path / "native")
    ends = []
    for name in ("numpy", "native"):
        candidate = fmu_cost.Candidate(name, tmp_path / name)
        ends.append(fmu_cost.through_fmpy(candidate, 50, rounds=6)[1])
    assert ends[0] == pytest.approx(ends[1], abs=fmu_cost.SAME)
    assert abs(ends[0][0]) > 1e-4


def test_the_c_host_drives_the_fmu_and_the_kernel_alike(tmp_path: Path) -> None:
    """Compiled in at the same flags: the same bits."""
    extract_archive(template(), tmp_path / "native")
    candidate = fmu_cost.Candidate("native", tmp_path / "native")
    host = fmu_cost.compiled_host(tmp_path)
    words = fmu_cost.host_words(candidate)
    words[3] = "50"
    uri = (candidate.place / "resources").as_uri()
    native, kernel = (
        fmu_cost.in_c_host(host, words),
        fmu_cost.in_c_host(host, ["kernel", uri, "50"]),
    )
    assert native[1] == kernel[1]
    assert min(native[0], kernel[0]) > 10.0
