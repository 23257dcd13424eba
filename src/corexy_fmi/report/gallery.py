"""Which figures the report shows, and under which captions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from markupsafe import Markup

from corexy_fmi.engine.evidence import Evidence, Law, Trace
from corexy_fmi.report import figures, plane
from corexy_fmi.report.corner import corner_window
from corexy_fmi.report.quantities import (
    NARROW,
    channel_label,
    channel_unit,
    number,
    prefix_for,
    quantity,
)
from corexy_fmi.report.words import ARGUMENTS, effect_name, place

MOST = 4  # figures of one kind
SPECTRUM = ("retuned", "explained", "noise")
Spans = Mapping[str, Sequence[tuple[float, float]]]


@dataclass(frozen=True)
class Picture:
    """One figure with its caption and the curves that its legend names."""

    svg: Markup
    caption: str
    legend: tuple[tuple[str, str], ...] = ()  # colour, words


@dataclass
class Gallery:
    """All figures of the page by section, and what the interactive view needs as well."""

    document: Mapping[str, Any]
    evidence: Evidence
    paths: list[Picture] = field(default_factory=list)
    times: list[Picture] = field(default_factory=list)
    heat: list[Picture] = field(default_factory=list)
    heat_key: list[tuple[str, str]] = field(default_factory=list)
    laws: list[Picture] = field(default_factory=list)
    spectra: list[Picture] = field(default_factory=list)

    @property
    def spans(self) -> Spans:
        """Stretches of time in which most of the mismatch lies, for each recording."""
        rows = (self.document.get("located") or {}).get("time") or []
        return {name: [(r[1], r[2]) for r in rows if r[0] == name] for name in {r[0] for r in rows}}

    def noise(self, trace: Trace, channel: str) -> float:
        """Noise of a channel as the document gives it, else 0."""
        rows = [r for r in self.document.get("fit") or [] if r.get("channel") == channel]
        own = [
            r for r in rows if r.get("recording") == trace.recording and r.get("role") == trace.role
        ]
        value = (own or rows or [{}])[0].get("noise_std")
        return float(value) if value and math.isfinite(value) else 0.0

    def chosen(self) -> Trace | None:
        """The recording to show: the one that the lead speaks of, else where most mismatch is."""
        rows = (self.document.get("located") or {}).get("time") or []
        corner = self.evidence.corner
        wanted = [corner.recording] if corner else [r[0] for r in rows]
        for name in wanted:
            for trace in self.evidence.traces:
                if trace.recording == name:
                    return trace
        return next(iter(self.evidence.traces), None)


def make_gallery(document: Mapping[str, Any], evidence: Evidence) -> Gallery:
    """Draw everything that the evidence allows."""
    gallery = Gallery(document, evidence)
    trace = gallery.chosen()
    if trace is not None and len(trace.time) > 1:
        _hang_curves(gallery, trace)
        if plane.has_plane(trace):
            _hang_plane(gallery, trace)
    _hang_forces(gallery)
    return gallery


def _hang_plane(gallery: Gallery, trace: Trace) -> None:
    """Paths, one corner, and the mismatch on the path before and after the explanation."""
    window = corner_window(trace)
    near = "; the square is shown from near" if window else ""
    picture = plane.plane_figure(trace, window, "plane")
    gallery.paths.append(Picture(picture, f"Path of {trace.recording}{near}."))
    if window:
        caption = "The corner where the retuned model misses most, one pass; dotted is the command."
        gallery.paths.append(Picture(plane.corner_figure(trace, window, "corner"), caption))
    edges = plane.heat_edges(trace)
    for model in ("retuned", "explained")[: 2 if trace.explained else 1]:
        svg = plane.heat_figure(trace, model, edges, f"heat-{model}")
        gallery.heat.append(Picture(svg, f"Measured against the {model} model, {trace.recording}."))
    gallery.heat_key = _heat_key(edges)


def _heat_key(edges: Sequence[float]) -> list[tuple[str, str]]:
    """Colour and range of sizes of each class."""
    scale, unit = prefix_for(edges[-1] / 2, "m")
    ends = [number(e * scale, 2) for e in edges]
    between = (f"{a} to {b}" for a, b in pairwise(ends))
    ranges = [f"under {ends[0]}", *between, f"over {ends[-1]}{NARROW}{unit}"]
    return [(f"heat{i}", text) for i, text in enumerate(ranges)]


def _hang_curves(gallery: Gallery, trace: Trace) -> None:
    """Mismatch of each channel in time, and its spectrum."""
    spans = gallery.spans.get(trace.recording, ())
    channels = [c for c in trace.measured if figures.mismatch(trace, c, "retuned") is not None]
    for i, channel in enumerate(channels[:MOST]):
        noise = gallery.noise(trace, channel)
        svg = figures.time_figure(trace, channel, noise, spans, f"time{i}")
        caption = f"Mismatch in {channel_label(channel)}, {trace.recording}"
        if noise:
            caption += f"; the band is noise, ± {quantity(2 * noise, channel_unit(channel))}"
        gallery.times.append(Picture(svg, f"{caption}."))
    for i, spectrum in enumerate(gallery.evidence.spectra[:MOST]):
        svg = figures.spectrum_figure(spectrum, f"spectrum{i}")
        caption = f"Spectrum of the mismatch in {channel_label(spectrum.channel)}."
        drawn = [k for k in SPECTRUM if np.isfinite(getattr(spectrum, k)).any()]
        gallery.spectra.append(Picture(svg, caption, tuple((k, k) for k in drawn)))


def _hang_forces(gallery: Gallery) -> None:
    """Missing force in time and against the variable that it depends on."""
    trace, forces = gallery.chosen(), gallery.evidence.missing_forces
    beside = [f for f in forces if trace is not None and f.recording == trace.recording]
    for i, force in enumerate((beside or list(forces))[:MOST]):
        svg = figures.force_figure(force, gallery.spans.get(force.recording, ()), f"force{i}")
        where = f"{place(force.coordinate)}, {force.recording}"
        caption = f"Missing force {where}; inside the band it is noise."
        gallery.times.append(Picture(svg, caption, (("retuned", "missing force"),)))
    groups: dict[tuple[str, str, str], list[Law]] = {}
    for law in gallery.evidence.laws:
        groups.setdefault((law.coordinate, law.argument, law.acts), []).append(law)
    for i, ((coordinate, argument, _), laws) in enumerate(list(groups.items())[:MOST]):
        legend = tuple(_law_legend(law, gallery.document) for law in laws)
        against = ARGUMENTS.get(argument, argument)
        what = f"Missing {laws[0].acts}"
        caption = f"{what} {place(coordinate)} against {against}, with its 95 % band."
        gallery.laws.append(Picture(figures.law_figure(laws, f"law{i}"), caption, legend))


def _law_legend(law: Law, document: Mapping[str, Any]) -> tuple[str, str]:
    """Colour and words of one law."""
    if law.source != "effect":
        return "measured", "read off the data"
    names = [effect_name(e.get("name", "")) for e in document.get("effects") or []]
    return "explained", " and ".join(names) or "as explained"
