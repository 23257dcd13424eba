"""Curves: mismatch in time, missing force, law, spectrum.  Each function returns inline SVG."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from corexy_fmi.engine.evidence import Array, Law, MissingForce, Spectrum, Trace
from corexy_fmi.report.decimate import Envelope, envelope, log_bins, with_gaps
from corexy_fmi.report.ink import INK, drawing
from corexy_fmi.report.quantities import channel_label, channel_unit, power_of_ten, prefix_for
from corexy_fmi.report.words import ARGUMENTS

BUCKETS = 480
MODELS = ("nominal", "retuned", "explained")
Spans = Sequence[tuple[float, float]]


def mismatch(trace: Trace, channel: str, model: str) -> Array | None:
    """Measured less simulated, None where either is absent."""
    measured, simulated = trace.measured.get(channel), getattr(trace, model).get(channel)
    if measured is None or simulated is None:
        return None
    difference = np.asarray(measured, float) - np.asarray(simulated, float)
    return difference if np.isfinite(difference).any() else None


def axis_scale(curves: Sequence[Array], unit: str) -> tuple[float, str]:
    """Scale and unit in which the largest value of some curves reads well."""
    largest = max((float(np.nanmax(np.abs(c))) for c in curves if len(c)), default=0.0)
    return prefix_for(largest / 2, unit)


def time_figure(trace: Trace, channel: str, noise: float, spans: Spans, key: str) -> Markup:
    """Mismatch of one channel in time under the three models, with the noise band."""
    curves = {m: d for m in MODELS if (d := mismatch(trace, channel, m)) is not None}
    shown = {m: envelope(trace.time, d, BUCKETS) for m, d in curves.items()}
    scale, unit = axis_scale([e.high for e in shown.values()], channel_unit(channel))
    label = f"Mismatch of {channel_label(channel)} in time under the three models"
    with drawing(key, label, 430, 225) as made:
        _spans(made.axes, spans)
        if noise > 0:
            made.axes.axhspan(-2 * noise * scale, 2 * noise * scale, color=INK["band"], linewidth=0)
        for model, curve in shown.items():
            _draw_envelope(made.axes, curve, scale, INK[model])
        _labels(made.axes, "time [s]", f"mismatch [{unit}]")
    return made.svg


def force_figure(force: MissingForce, spans: Spans, key: str) -> Markup:
    """Missing force of one coordinate in time, with the band that noise alone would give."""
    shown = envelope(force.time, force.force, BUCKETS)
    band = np.broadcast_to(np.asarray(force.band95, float), force.force.shape)
    limit = envelope(force.time, band, BUCKETS)
    scale, unit = axis_scale([shown.high, shown.low], force.unit)
    with drawing(key, "Missing force in time, with the band of noise alone", 430, 225) as made:
        _spans(made.axes, spans)
        top = limit.high * scale
        made.axes.fill_between(limit.time, -top, top, color=INK["band"], linewidth=0)
        _draw_envelope(made.axes, shown, scale, INK["retuned"])
        _labels(made.axes, "time [s]", f"missing force [{unit}]")
    return made.svg


def law_figure(laws: Sequence[Law], key: str) -> Markup:
    """Missing force or friction against its variable: read off the data, and as named."""
    along, along_unit = axis_scale([law.grid for law in laws], laws[0].argument_unit)
    scale, unit = axis_scale(
        [a for w in laws for a in (w.value, w.lower, w.upper)], laws[0].force_unit
    )
    what = f"missing {laws[0].acts}"
    with drawing(key, f"{what.capitalize()} against the variable it depends on", 430, 260) as made:
        made.axes.axhline(0, color=INK["rule"], linewidth=1)
        for law in laws:
            colour = INK["explained" if law.source == "effect" else "measured"]
            grid, band = law.grid * along, (law.lower * scale, law.upper * scale)
            made.axes.fill_between(grid, *band, color=colour, alpha=0.16, linewidth=0)
            made.axes.plot(grid, law.value * scale, color=colour)
        argument = ARGUMENTS.get(laws[0].argument, "argument")
        _labels(made.axes, f"{argument} [{along_unit}]", f"{what} [{unit}]")
    return made.svg


def spectrum_figure(spectrum: Spectrum, key: str) -> Markup:
    """Amplitude density of one channel's mismatch, retuned and explained, over its noise."""
    scale, unit = axis_scale([spectrum.retuned], channel_unit(spectrum.channel))
    with drawing(key, "Spectrum of the mismatch, retuned, explained and noise", 430, 260) as made:
        for name, colour in (
            ("noise", "nominal"),
            ("retuned", "retuned"),
            ("explained", "explained"),
        ):
            frequency, density = log_bins(spectrum.frequency, getattr(spectrum, name))
            taken = density > 0
            if taken.any():  # not where nothing was explained
                made.axes.loglog(
                    frequency[taken], scale * density[taken], color=INK[colour], linewidth=1.2
                )
        made.axes.minorticks_off()
        for axis in (made.axes.xaxis, made.axes.yaxis):
            axis.set_major_formatter(_power)
        _labels(made.axes, "frequency [Hz]", f"mismatch density [{unit}/√Hz]")
    return made.svg


def _draw_envelope(axes: Axes, curve: Envelope, scale: float, colour: str) -> None:
    """A line, or a filled ribbon from least to greatest where samples were merged."""
    if not len(curve.time):
        return
    time, low, high = with_gaps(curve.time, curve.low * scale, curve.high * scale)
    if curve.merged:
        axes.fill_between(time, low, high, color=colour, linewidth=0.8)
    else:
        axes.plot(time, low, color=colour, linewidth=1)


def _spans(axes: Axes, spans: Spans) -> None:
    """Shade the stretches of time that matter most."""
    for begin, end in spans:
        axes.axvspan(begin, end, color=INK["span"], linewidth=0)


def _power(value: float, _: float) -> str:
    """A tick of a logarithmic axis: plain near 1, else a power of ten."""
    return f"{value:g}" if 0.01 <= value <= 1000 else power_of_ten(round(math.log10(value)))


def _labels(axes: Axes, horizontal: str, vertical: str) -> None:
    """Axis titles with units, and tight horizontal limits."""
    axes.set_xlabel(horizontal.replace(" []", ""))
    axes.set_ylabel(vertical.replace(" []", ""))
    axes.margins(x=0.01)
