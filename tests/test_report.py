"""The report: one honest, well-formed, self-contained page that nothing can inject into."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from corexy_fmi.engine.evidence import CornerSize, Evidence, Finding, MissingForce, RunnerUp, Trace
from corexy_fmi.report import render_report, write_report
from corexy_fmi.report.decimate import with_gaps
from tests.report_cases import NOISE, VERDICTS, make_document, make_evidence, make_trace, warned

VOID = {"meta", "input", "br", "link", "img"}
SMALL = 1300  # rows
HOSTILE = (
    "<script>alert(1)</script>",
    "</script><img src=x onerror=alert(1)>",
    "\" onmouseover=\"alert(1)' onload='alert(1)",
    "</style><svg onload=alert(1)>{{ 7 * 7 }}{% raw %}",
    "<!-- ]]> --><b>\u2028$\\frac{",
    "caf\udce9.csv",
)


class Page(HTMLParser):
    """Every element with its attributes, checked for nesting; the text outside of scripts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: list[str] = []
        self.texts: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        assert len(dict(attrs)) == len(attrs), f"attribute twice on {tag}"
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        (self.scripts if self.open[-1:] == ["script"] else self.texts).append(data)

    @property
    def text(self) -> str:
        """What a reader sees, no-break spaces made plain."""
        return re.sub(r"\s+", " ", " ".join(self.texts))

    @property
    def data(self) -> list[dict[str, Any]]:
        """What the interactive view gets; NaN is no JSON."""

        def refuse(name: str) -> None:
            raise ValueError(name)

        return json.loads(self.scripts[0], parse_constant=refuse)


def shown(document: dict[str, Any], evidence: Evidence) -> Page:
    return Page(render_report(document, evidence))


@cache
def usual(verdict: str = "explained") -> Page:
    """The page of a made-up case as it stands."""
    return shown(make_document(verdict), make_evidence(verdict, SMALL))


@cache
def harmless() -> Page:
    """The page that hostile texts must not change."""
    return shown(*hostile_case("harmless"))


@pytest.mark.parametrize("verdict", VERDICTS)
def test_page_is_well_formed_and_loads_nothing(verdict):
    text = render_report(*warned(make_document(verdict), make_evidence(verdict, SMALL)))
    page = Page(text)
    assert "http://" not in text
    assert "https://" not in text
    for tag, attributes in page.elements:
        assert tag not in {"link", "img", "iframe", "object", "base", "image"}
        for name in ("src", "href", "xlink:href", "action"):
            assert (attributes.get(name) or "#").startswith("#")
    assert set(re.findall(r"url\((.)", text)) <= {"#"}
    ids = [a["id"] for _, a in page.elements if "id" in a]
    assert len(ids) == len(set(ids))
    named = {a["aria-labelledby"] for _, a in page.elements if "aria-labelledby" in a}
    assert named <= set(ids)
    linked = {a["xlink:href"][1:] for _, a in page.elements if a.get("xlink:href")}
    assert linked <= set(ids)


@pytest.mark.parametrize("verdict", VERDICTS)
def test_page_is_accessible(verdict):
    page = usual(verdict)
    assert ("html", {"lang": "en"}) in page.elements
    levels = [int(tag[1]) for tag, _ in page.elements if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))
    pictures = [a for tag, a in page.elements if tag in ("svg", "canvas")]
    assert pictures
    assert all(a.get("role") == "img" and a.get("aria-label") for a in pictures)


def test_explained_leads_with_cause_place_size_and_remedy():
    document = make_document()
    text = shown(document, make_evidence(rows=SMALL)).text
    assert "Backlash at motor 1 shifts the path by 0.111 mm at the corner." in text
    assert "With it the path misses the corner by 0.142 mm, without it by 0.031 mm" in text
    assert document["effects"][0]["remedy"] in text
    assert document["effects"][0]["check"] in text
    assert "from 57.0 µm to 20.2 µm; noise alone is 20.0 µm" in text
    assert "20.3 to 21.3 mrad" in text


def test_several_effects_are_named_together():
    document = make_document()
    other = document["effects"][0] | {"name": "stribeck_friction", "location": "x"}
    document["effects"].append(other)
    text = shown(document, make_evidence(rows=SMALL)).text
    assert "Backlash at motor 1 and Stribeck friction on the x axis together shift the path" in text
    text = shown(document, replace(make_evidence(rows=SMALL), corner=None)).text
    assert "are what the simulation left out." in text


def test_ambiguous_names_the_class_and_the_next_experiment():
    text = usual("ambiguous").text
    assert "Backlash at motor 1 or Stribeck friction on both axes: these recordings" in text
    assert "Run the program next.csv." in text


def test_ambiguous_knows_combinations_lone_members_and_many():
    document = make_document("ambiguous")
    a, b = document["ambiguous_between"][0]
    document["ambiguous_sets"] = [[[a], [a, b]]]
    text = shown(document, Evidence()).text
    assert "Backlash at motor 1 or backlash at motor 1 with Stribeck friction" in text
    document["ambiguous_sets"] = []
    document["ambiguous_between"] = [[a]]
    assert (
        "Backlash at motor 1 or retuned machine parameters alone"
        in shown(document, Evidence()).text
    )
    document["ambiguous_between"] = [[a, b, a, b]]
    assert "One of 4 causes" in shown(document, Evidence()).text


def test_unexplained_says_where_and_how():
    text = usual("unexplained").text
    assert "Something is missing on the x axis, and no known cause fits it." in text
    assert "A force on x that depends on vx, ±0.24 N over the range seen." in text
    assert "Read the law below" in text
    assert "Where it may lie" in text
    assert "On the x axis" in text
    assert "61.5" in text
    assert "Where it may lie" not in usual("explained").text


def test_a_law_of_friction_is_shown_as_friction():
    found = make_evidence("unexplained", SMALL)
    laws = tuple(replace(law, argument="x", acts="friction") for law in found.laws)
    text = shown(make_document("unexplained"), replace(found, laws=laws)).text
    assert "It shows the missing friction against the variable it depends on." in text
    assert "Missing friction on the x axis against position" in text
    assert "Missing force on the x axis against" not in text


def test_nothing_missing_points_at_the_bounds():
    text = usual("nothing_missing").text
    assert "Nothing is missing: after retuning, the rest is noise." in text
    assert (
        "What the retuned model leaves is 20.2 µm rms; the noise of the recordings is 20.0 µm"
        in text
    )
    assert "83.0 µs" in text


def test_warnings_come_first_and_only_when_due():
    calm = usual()
    assert not [tag for tag, _ in calm.elements if tag == "aside"]
    text = shown(*warned(make_document(), make_evidence(rows=SMALL))).text
    lead = text.index("shifts the path by")
    lead = text.index("shifts the path by", lead + 1)  # the first is the title
    for warning in (
        "train2.csv: x and y are given in mm.",
        "Motor inertia had to be retuned",
        "4.1 sigma",
        "surrogate yin2018 was assumed",
        "Stand-in numbers",
        "The proof is weak",
    ):
        assert 0 < text.index(warning) < lead


def test_heldout_of_mixed_channels_is_told_in_multiples_of_the_noise():
    document = make_document()
    for row, channel in zip(document["fit"], ("ax", "phi1_meas") * 3, strict=True):
        row["channel"] = channel
    assert "2.85 \u00d7 noise" in shown(document, Evidence()).text


@pytest.mark.parametrize("verdict", [*VERDICTS, "something new"])
def test_empty_parts_are_left_out(verdict):
    for document in ({"verdict": verdict}, make_document(verdict)):
        page = shown(document, Evidence())
        assert page.data == []
        assert "path" not in [a.get("id") for _, a in page.elements]
    bare = dict.fromkeys(make_document()) | {"verdict": verdict}
    assert shown(bare, Evidence(topology="single_axis")).text


def test_unknown_numbers_are_dashes_and_never_break_the_page():
    document, evidence = make_document(), make_evidence(rows=SMALL)
    document["heldout"] = dict.fromkeys(document["heldout"]) | {"weak": True}
    document["fit"][0] |= {"noise_std": float("nan"), "rms_nominal": None, "channel": "odd"}
    document["not_excluded"][0]["upper95"] = float("inf")
    nowhere = np.full(SMALL, np.nan)
    trace = replace(evidence.traces[0], x_ref=nowhere, y_ref=nowhere)
    corner = CornerSize(float("nan"), 0.1, "train1.csv")
    page = shown(document, replace(evidence, traces=(trace,), corner=corner))
    assert "is what the simulation left out" in page.text
    assert "nan" not in page.text.lower().replace("resonan", "")


def test_other_channels_and_short_recordings_are_drawn():
    trace = make_trace("one.csv", "train", SMALL)
    maps = {
        m: {"ax": getattr(trace, m)["x"], "i1": getattr(trace, m)["y"]}
        for m in ("measured", "nominal", "retuned", "explained")
    }
    page = shown(make_document(), Evidence(traces=(replace(trace, **maps),)))
    assert "Mismatch in x acceleration, one.csv" in page.text
    assert [p["title"] for p in page.data] == [
        "mismatch in x acceleration",
        "mismatch in motor 1 current",
    ]
    one = {m: {"x": np.zeros(1), "y": np.zeros(1)} for m in maps}
    point = Trace(
        "p.csv",
        "train",
        np.zeros(1),
        one["measured"],
        one["nominal"],
        one["retuned"],
        one["explained"],
        np.zeros(1),
        np.zeros(1),
    )
    assert shown(make_document(), Evidence(traces=(point,))).data
    still = replace(trace, **{m: {"x": np.zeros(SMALL), "y": np.zeros(SMALL)} for m in maps})
    assert shown(make_document(), Evidence(traces=(still,))).data


def hostile_case(evil: str) -> tuple[dict[str, Any], Evidence]:
    """Every text that a recording, a machine file or an effect file can bring, made hostile."""
    document, evidence = warned(make_document("ambiguous"), make_evidence("ambiguous", SMALL))
    texts = ("name", "location", "equation", "citation", "remedy", "check", "description")
    document["effects"] = [document["effects"][0] | dict.fromkeys(texts, evil)]
    document["effects"][0]["parameters"] = {evil: {"value": 1.0, "unit": evil, "ci95": [0.9, 1.1]}}
    document["effects"][0]["alternatives"] = [{"name": evil, "location": evil, "probability": 0.1}]
    document["ambiguous_between"] = [[{"name": evil, "location": evil}] * 2]
    document["next_experiment"] = {"why": evil, "program": evil}
    document["located"] |= {"coordinate": evil, "state": evil, "time": [[evil, 0.1, 0.2, 0.3]]}
    document["fit"] = [
        row | {"recording": evil, "role": evil, "channel": evil} for row in document["fit"]
    ]
    document["retuned"] = {evil: {"value": 1.0, "unit": evil, "ci95": [0.9, 1.1], "pull": 5.0}}
    document["not_excluded"] = [
        {"name": evil, "location": evil, "parameter": evil, "upper95": 1.0, "unit": evil}
    ]
    trace = evidence.traces[0]
    maps = {
        m: getattr(trace, m) | {evil: trace.time * 1.0} for m in ("nominal", "retuned", "explained")
    }
    trace = replace(
        trace, recording=evil, measured=trace.measured | {evil: trace.time * 2.0}, **maps
    )
    force = MissingForce(evil, evil, trace.time, trace.time, 0.5, "N")
    laws = tuple(
        replace(w, coordinate=evil, argument=evil, argument_unit="m") for w in evidence.laws
    )
    evidence = replace(
        evidence,
        traces=(trace,),
        missing_forces=(force,),
        laws=laws,
        machine_name=evil,
        surrogate=evil,
        spectra=tuple(replace(s, channel=evil) for s in evidence.spectra),
        runners_up=(RunnerUp(evil, evil, 0.5, 3.0, None, evil),),
        preflight=(Finding(evil, evil),),
        corner=CornerSize(0.2, 0.1, evil),
    )
    return document | {"verdict": "ambiguous"}, evidence


@pytest.mark.parametrize("evil", HOSTILE)
def test_nothing_injects_markup_or_script(evil, tmp_path):
    write_report(tmp_path / "report.html", *hostile_case(evil))
    page = Page((tmp_path / "report.html").read_text("utf-8"))
    assert [tag for tag, _ in page.elements if tag not in ("code", "svg", "path")] == [
        tag for tag, _ in harmless().elements if tag not in ("code", "svg", "path")
    ]
    allowed = {name for _, a in harmless().elements for name in a}
    assert {name for _, a in page.elements for name in a} <= allowed | {"d", "fill"}
    assert len(page.scripts) == 2
    assert page.scripts[1] == harmless().scripts[1]
    if evil.isascii():
        assert page.data[0]["recording"] == f"{evil} (training)"
        assert evil in " ".join(page.texts)


def test_only_the_reports_own_script_may_run():
    page = usual()
    own = base64.b64encode(hashlib.sha256(page.scripts[1].encode()).digest()).decode()
    policy = next(a["content"] for _, a in page.elements if a.get("http-equiv"))
    assert policy == f"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{own}'"


def test_same_input_gives_the_same_page():
    case = make_document(), make_evidence(rows=SMALL)
    assert render_report(*case) == render_report(*case)


def test_long_recordings_stay_small(tmp_path):
    rows = 200_000
    trace = make_trace("long.csv", "train", rows)
    traces = tuple(replace(trace, recording=f"long{i}.csv") for i in range(12))
    write_report(tmp_path / "report.html", make_document(), Evidence(traces=traces))
    assert (tmp_path / "report.html").stat().st_size < 6e6
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_many_recordings_stay_small():
    trace = make_trace("short.csv", "train", SMALL)
    traces = tuple(replace(trace, recording=f"short{i}.csv") for i in range(700))
    document = make_document() | {"fit": make_document()["fit"] * 300}
    assert len(text := render_report(document, Evidence(traces=traces))) < 6e6
    assert "more curves did not fit" in text


def test_report_in_a_new_folder(tmp_path):
    target = tmp_path / "new" / "report.html"
    write_report(Path(target), make_document(), Evidence())
    assert target.read_text("utf-8").lstrip().startswith("<!DOCTYPE html>")


def test_nothing_missing_above_the_noise_is_not_hidden():
    document = make_document("nothing_missing")
    document["heldout"]["rms_retuned"] = 4.2e-5
    text = shown(document, Evidence()).text
    assert "The held-out mismatch, 42.0 µm, stands above the noise, 20.0 µm." in text
    assert "the rest is noise" not in text


def test_dropouts_are_gaps_not_bridges():
    time = np.concatenate((np.arange(100), np.arange(300, 400))) * 1e-3
    moved, values = with_gaps(time, time)
    assert np.isnan(values[100])
    assert np.isnan(values).sum() == 1
    assert len(moved) == 201
    assert len(with_gaps(time[:1], time[:1])[0]) == 1
    trace = make_trace("gap.csv", "train", 4000)
    away = (trace.time > 1) & (trace.time < 2)
    measured = {c: np.where(away, np.nan, v) for c, v in trace.measured.items()}
    assert shown(make_document(), Evidence(traces=(replace(trace, measured=measured),))).data


def test_a_gain_within_the_noise_is_told_as_such():
    """No share of next to nothing: an rms hardly above the noise hides what a likelihood sees."""
    document = make_document("unexplained")
    document["heldout"] |= {"rms_retuned": 1.004 * NOISE, "excess_removed": 4.085}
    text = render_report(document, make_evidence("unexplained", SMALL))
    assert "too small beside the noise" in text
    assert "of what exceeds the noise" not in text
    assert "of what exceeds the noise" in render_report(
        make_document("unexplained"), make_evidence("unexplained", SMALL)
    )
