"""From a diagnosis to one HTML file: gather, render, write beside and rename."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader
from markupsafe import Markup

from corexy_fmi.engine.evidence import Evidence
from corexy_fmi.files import write_beside
from corexy_fmi.report import charts, tables
from corexy_fmi.report.equation import typeset
from corexy_fmi.report.gallery import make_gallery
from corexy_fmi.report.lead import classes, make_lead
from corexy_fmi.report.notices import make_notices
from corexy_fmi.report.quantities import number, percent
from corexy_fmi.report.sentences import seen
from corexy_fmi.report.viewer import make_view
from corexy_fmi.report.words import STATES, cause, sentence, tied


def write_report(path: Path, document: Mapping[str, Any], evidence: Evidence) -> None:
    """Write the report of a diagnosis (CONTRACT 4) as one self-contained HTML file."""
    page = render_report(document, evidence)
    with write_beside(Path(path)) as beside:
        beside.write_bytes(page.encode("utf-8", errors="replace"))


def render_report(document: Mapping[str, Any], evidence: Evidence) -> str:
    """The report as text."""
    surroundings, evidence = _environment(), _to_show(document, evidence)
    script = _source("viewer.js")
    return surroundings.get_template("report.html").render(
        document=document,
        evidence=evidence,
        lead=make_lead(document, evidence),
        notices=make_notices(document, evidence),
        classes=classes(document),
        seen=seen(document.get("heldout") or {}),
        style=Markup(_source("style.css")),
        script=Markup(script),
        script_hash=_hash(script),
        **_charts(document, evidence),
        **_tables(document, evidence),
    )


def _to_show(document: Mapping[str, Any], evidence: Evidence) -> Evidence:
    """Without the explained curves where nothing was explained: they are the retuned ones."""
    if document.get("verdict") != "nothing_missing":
        return evidence
    traces = tuple(replace(t, explained={}) for t in evidence.traces)
    spectra = tuple(replace(s, explained=np.full_like(s.retuned, np.nan)) for s in evidence.spectra)
    return replace(evidence, traces=traces, spectra=spectra)


def _charts(document: Mapping[str, Any], evidence: Evidence) -> dict[str, Any]:
    """Everything that is drawn."""
    pulls, far = charts.pull_bars(document)
    gallery = make_gallery(document, evidence)
    return {
        "bars": charts.rms_bars(document),
        "marked": charts.marked_parts(document) if evidence.topology == "corexy" else None,
        "pulls": pulls,
        "far": far,
        "gallery": gallery,
        "viewer": make_view(evidence, gallery.noise, gallery.spans),
    }


def _tables(document: Mapping[str, Any], evidence: Evidence) -> dict[str, Any]:
    """Everything that is listed."""
    return {
        "parameters": tables.parameters(document),
        "retuned": tables.retuned(document),
        "sites": tables.sites(document),
        "runners_up": tables.runners_up(document, evidence),
        "alternatives": tables.alternatives(document),
        "not_excluded": tables.not_excluded(document),
        "fits": tables.fits(document),
    }


@lru_cache(maxsize=1)
def _environment() -> Environment:
    """Jinja with escaping always on and the report's own filters."""
    made = Environment(
        loader=PackageLoader("corexy_fmi.report"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {
        "cause": cause, "number": number, "percent": percent, "sentence": sentence, "tied": tied,
        "typeset": typeset,
    }  # fmt: skip
    made.globals["states"] = STATES
    return made


def _source(name: str) -> str:
    """One of the report's own files as it stands."""
    return resources.files("corexy_fmi.report").joinpath("templates", name).read_text("utf-8")


def _hash(script: str) -> str:
    """What the page's content security policy knows its only script by."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
