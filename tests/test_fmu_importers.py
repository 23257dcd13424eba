"""Other people's importers: what was measured, and again each one that is installed here."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from fmu_kit import FLAVOURS, template

from benchmarks import importers


def test_the_page_shows_what_was_measured() -> None:
    """Every importer ran both flavours and gave fmpy's trajectory to 1e-12; no complaint."""
    document = json.loads(importers.RESULT.read_text(encoding="utf-8"))
    assert importers.table(document) in importers.DOCUMENT.read_text(encoding="utf-8")
    ran = {(row["flavour"], row["importer"]) for row in document["rows"]}
    names = {*importers.PACKAGES.values(), importers.CHECKER}
    assert ran == {(flavour, name) for flavour in FLAVOURS for name in names}
    for row in document["rows"]:
        assert row.get("difference", 0.0) < importers.LIMIT
        assert row.get("complaints", []) == []
        assert row.get("stroke_m", 1.0) > 1e-3
        assert "failed" not in row


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.parametrize("name", ["ecos", "libcosim"])
def test_an_importer_gives_fmpys_trajectory(name: str, flavour: str, tmp_path: Path) -> None:
    """In processes of their own; to 1e-12 m."""
    package = importers.PACKAGES[name]
    if importers.installed(package) is None:
        pytest.skip(f"the importer {package} is not installed (pip install {package})")
    expected, found = (importers.driven(n, template(flavour), tmp_path) for n in ("fmpy", name))
    assert np.abs(found - expected).max() < importers.LIMIT
    assert np.ptp(found[:, 0]) > 1e-3


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_the_toolbox_has_no_complaint(flavour: str) -> None:
    """XSD and semantic rules of FMI 2.0.5."""
    if importers.installed(importers.CHECKER) is None:
        pytest.skip(f"{importers.CHECKER} is not installed (pip install {importers.CHECKER})")
    assert importers.checked(template(flavour)) == []


def test_an_importer_that_fails_says_so(tmp_path: Path) -> None:
    """A file that is no FMU."""
    (tmp_path / "no.fmu").write_text("no zip")
    with pytest.raises(RuntimeError, match="fmpy: status 1"):
        importers.driven("fmpy", tmp_path / "no.fmu", tmp_path)
