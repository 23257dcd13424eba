"""What the interactive view holds: every curve in time, in buckets, and the worst place in full.

Curves are 16-bit integers with a scale, in base64, because an hour at 1 kHz has to fit; the script
``viewer.js`` draws them.  Two levels for each channel: the whole recording as least and greatest
value of each bucket, and, where that merged samples, a stretch around the worst place as taken.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from corexy_fmi.engine.evidence import Array, Evidence, MissingForce, Trace
from corexy_fmi.report.decimate import envelope
from corexy_fmi.report.figures import MODELS, mismatch
from corexy_fmi.report.quantities import channel_label, channel_unit
from corexy_fmi.report.words import place

BUDGET = 90_000  # buckets on the page, at most about 40 bytes each
FINEST, COARSEST = 12_000, 200  # buckets of one channel
STRETCH = 2000  # samples shown as they were taken, at most
MOST = BUDGET // COARSEST  # panels

Noise = Callable[[Trace, str], float]
Curves = Mapping[str, Array]


@dataclass(frozen=True)
class View:
    """The panels to choose from, and how many more did not fit on the page."""

    panels: list[dict[str, Any]]
    left_out: int


def make_view(evidence: Evidence, noise: Noise, spans: Mapping[str, Any]) -> View:
    """One panel for each missing force and for each channel of each recording."""
    channels = [
        (t, c) for t in evidence.traces for c in t.measured if mismatch(t, c, "retuned") is not None
    ]
    number = len(evidence.missing_forces) + len(channels)
    buckets = int(np.clip(BUDGET // max(number, 1), COARSEST, FINEST))
    panels = [_channel_panel(t, c, noise(t, c), spans, buckets) for t, c in channels[:MOST]]
    headings = {t.recording: _heading(t) for t in reversed(evidence.traces)}
    for force in evidence.missing_forces[: MOST - len(panels)]:
        heading = headings.get(force.recording, force.recording)
        panels.append(_force_panel(force, heading, spans, buckets))
    return View(panels, number - len(panels))


def _heading(trace: Trace) -> str:
    """Recording and role, as the list of the view shows them."""
    return f"{trace.recording} ({'held out' if trace.role == 'holdout' else 'training'})"


def _channel_panel(
    trace: Trace, channel: str, noise: float, spans: Mapping[str, Any], buckets: int
) -> dict[str, Any]:
    """Mismatch of one channel of one recording under the three models."""
    curves = {m: d for m in MODELS if (d := mismatch(trace, channel, m)) is not None}
    return {
        "recording": _heading(trace),
        "title": f"mismatch in {channel_label(channel)}",
        "unit": channel_unit(channel),
        "band": 2 * noise,
        "spans": spans.get(trace.recording, []),
        "levels": _levels(trace.time, curves, curves["retuned"], buckets),
    }


def _force_panel(
    force: MissingForce, heading: str, spans: Mapping[str, Any], buckets: int
) -> dict[str, Any]:
    """Missing force of one coordinate of one recording."""
    return {
        "recording": heading,
        "title": f"missing force {place(force.coordinate)}",
        "unit": force.unit,
        "band": float(np.nan_to_num(np.median(force.band95))),
        "spans": spans.get(force.recording, []),
        "levels": _levels(force.time, {"retuned": force.force}, force.force, buckets),
    }


def _levels(time: Array, curves: Curves, judge: Array, buckets: int) -> list[dict[str, Any]]:
    """The whole in buckets; where samples were merged, also the worst place in full."""
    taken = np.flatnonzero(np.isfinite(judge))
    if len(taken) <= buckets:
        return [_level(time[taken], {n: c[taken] for n, c in curves.items()}, buckets)]
    middle = int(np.argmax(np.abs(judge[taken])))
    stretch = min(STRETCH, buckets)
    first = min(max(middle - stretch // 2, 0), len(taken) - stretch)
    near = taken[first : first + stretch]
    whole = _level(time[taken], {n: c[taken] for n, c in curves.items()}, buckets)
    return [whole, _level(time[near], {n: c[near] for n, c in curves.items()}, stretch)]


def _level(time: Array, curves: Curves, buckets: int) -> dict[str, Any]:
    """Times from the first one and the curves over them, packed."""
    packed, start = {}, float(time[0])
    for name, values in curves.items():
        shown = envelope(time, np.nan_to_num(values), buckets)
        scale = float(max(np.abs(shown.low).max(), np.abs(shown.high).max())) / 32767 or 1.0
        packed[name] = {"scale": scale, "low": _packed(shown.low / scale, "<i2")}
        if shown.merged:
            packed[name]["high"] = _packed(shown.high / scale, "<i2")
    return {"start": start, "time": _packed(shown.time - start, "<f4"), "curves": packed}


def _packed(values: Array, kind: str) -> str:
    """Numbers as base64 of little-endian 16-bit integers or 32-bit floats."""
    whole = np.rint(values) if kind == "<i2" else values
    return base64.b64encode(whole.astype(kind).tobytes()).decode("ascii")
