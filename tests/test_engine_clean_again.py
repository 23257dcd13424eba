"""Spikes that what is missing hides are found beside the best cause, and all are fitted again."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from engine_kit import machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting.clean import without_spikes
from corexy_fmi.engine.fitting.fit import minimise, settle
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.clean_again import without_more_spikes
from corexy_fmi.engine.naming.entries import entry_of
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.naming.search import long_fit
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

NOISE, EVERY = 5e-6, 10  # [m]; rows of which one has samples
BAD = np.array([300, 900, 1500])  # rows of spikes
RIPPLE = {"amplitude": 1e-4, "phase": 0.4, "teeth": 16.0}


@cache
def competition(height):
    """The retuned machine and a tooth ripple beside it, with spikes of so many deviations in x."""
    truth = with_effects(machine(), EffectUse("tooth_ripple", "motor1", RIPPLE))
    shown = record(truth, rich_motion(), noise=NOISE)
    seen = np.where(np.arange(len(shown)) % EVERY == 0, 1.0, np.nan)
    x, y = seen * shown["x"], seen * shown["y"]
    x[BAD] += height * NOISE
    shown = replace(shown, channels={**shown.channels, "x": x, "y": y})
    base = retune(bundled_layout(), machine(), problem(shown, machine(), std=NOISE).runs)
    ripple = Hypothesis((bundled_layout().find("tooth_ripple", "motor1"),))
    lead = screen(base, [ripple], map)[0]
    ends = [long_fit(minimise(lead.problem, start, 1)) for start in lead.starts]
    return base, [entry_of(base, settle(min(ends, key=lambda fit: fit.cost)))]


def left_out(fit):
    """Rows that no sample of x was taken at."""
    (run,) = fit.problem.runs
    x = next(s for s in run.samples if s.channel == "x")
    return sorted(set(range(0, len(run.excitation.time), EVERY)) - set(x.index.tolist()))


def test_a_ripple_hides_spikes_until_it_is_explained():
    base, entries = competition(9.0)
    assert left_out(base) == []
    again, (entry,) = without_more_spikes(base, entries, map)
    assert left_out(again) == left_out(entry.fit) == BAD.tolist()
    assert entry.gain == pytest.approx(entry_of(again, entry.fit).gain)
    assert entry.gain > entries[0].gain
    assert [run.count for run in without_spikes(entry.fit)] == [r.count for r in again.problem.runs]


def test_where_there_are_none_nothing_is_fitted_again():
    base, entries = competition(0.0)
    assert without_more_spikes(base, entries, map) == (base, entries)
    base, entries = competition(9.0)
    faint = [replace(entries[0], gain=5.0)]
    assert without_more_spikes(base, faint, map) == (base, faint)
