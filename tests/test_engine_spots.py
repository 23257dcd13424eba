"""A spot on an axis, narrower than the knots of a law: found by its place, fitted, else nothing."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from engine_kit import machine, problem, record, rich_motion, short_motion

from corexy_fmi.engine.entries import Competition
from corexy_fmi.engine.free_form import law_values
from corexy_fmi.engine.probe_laws import FINE
from corexy_fmi.engine.retune import retune
from corexy_fmi.engine.site import Site, sites
from corexy_fmi.engine.spots import ACROSS, _windows, with_spot
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import FreeForm

SPOT, HALF = 0.0112, 2e-3  # [m] of y: its middle, from there to either end
BUMP = FreeForm("y", "y", (SPOT - HALF, SPOT - HALF / 2, SPOT + HALF / 2, SPOT + HALF),
                (0.0, -0.8, 0.8, 0.0))  # fmt: skip


@cache
def base(bumpy):
    """The retuned machine on a recording, with a magnet beside the rail or without."""
    truth = replace(machine(), free_forms=(BUMP,) if bumpy else ())
    shown = record(truth, rich_motion(), noise=5e-6)
    return retune(bundled_layout(), machine(), problem(shown, machine(), std=5e-6).runs)


def alone(fit):
    """A competition that nothing has entered."""
    return Competition(fit, (), (), 1.0)


def test_a_spot_is_found_at_its_place_and_fitted():
    found = sites(alone(base(True)), map)
    assert found[0].location == "y"
    assert found[0].state == "position"
    assert found[0].word in ("y near 10 mm", "y near 11 mm", "y near 12 mm")
    first = with_spot(alone(base(True)), found, map).entries[0]
    law, values = first.hypothesis.law, law_values(first.fit)
    assert (law.location, law.argument) == ("y", "y")
    assert first.gain > found[0].gain
    at = SPOT + np.array([-HALF / 2, HALF / 2])
    assert np.diff(np.interp(at, law.knots, values))[0] == pytest.approx(1.6, rel=0.25)


def test_without_one_nothing_is_added():
    fit = base(False)
    found = sites(alone(fit), map)
    assert all(s.gain < 10 for s in found)
    assert with_spot(alone(fit), found, map).entries == ()


@pytest.mark.parametrize(
    "site",
    [Site("motor1", 500.0, "position"), Site("y", 500.0, "speed"), Site("y", 9.0, "position")],
)
def test_only_a_place_on_an_axis_that_pays_is_looked_at(site):
    shown = record(machine(), short_motion())
    given = alone(retune(bundled_layout(), machine(), problem(shown, machine()).runs))
    assert with_spot(given, [site], map) is given


def test_windows_cover_the_axis():
    wide = type("Law", (), {"location": "y", "argument": "y", "knots": (-0.1, 0.1), "scale": 1.0})
    found = _windows(wide)
    step = 0.2 / (FINE - 1)
    assert all(np.allclose(np.diff(w.knots), step) and len(w.knots) == ACROSS for w in found)
    places = np.linspace(-0.1, 0.1, 200)
    reach = [max(min(p - w.knots[1], w.knots[-2] - p) for w in found) for p in places]
    assert min(reach) > step  # every spot lies well inside of one of them
