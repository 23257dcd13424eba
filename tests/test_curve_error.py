"""The error of a free-form law against the planted force (benchmarks/concealed/curve.py)."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.concealed.curve import curve_error

TIME = 1e-3 * np.arange(4000)
PLACE = 0.05 * np.sin(2 * np.pi * 0.7 * TIME)
SPEED = np.gradient(PLACE, TIME)
FORCE = np.cos(2 * np.pi * PLACE / 0.03)
KNOTS = np.linspace(-0.05, 0.05, 201)


SLIDES = np.ones((len(TIME), 2), dtype=bool)


def case(missing: list[int], force: np.ndarray = FORCE, zero: bool = True) -> SimpleNamespace:
    rows = [f"{t!r},0.0,0.0" for n, t in enumerate(TIME.tolist()) if n not in missing]
    text = "# zero: x, y\n" * zero + "\n".join(["time,phi1,phi2", *rows])
    return SimpleNamespace(
        train={"train1.csv": text},
        train_clean={"train1.csv": {"x": PLACE, "y": PLACE}},
        planted_force={
            "force": [np.column_stack([force, 0 * force])],
            "speed": [np.column_stack([SPEED, SPEED])],
            "slides": [SLIDES],
        },
    )


@pytest.mark.parametrize("missing", [[], [7, *range(1000, 1800)]], ids=["whole", "rows missing"])
@pytest.mark.parametrize(("factor", "error"), [(1.0, 0.0), (0.8, 0.2), (0.0, 1.0)])
def test_the_error_is_the_share_that_the_law_leaves(missing, factor, error):
    law = {"name": "free_form", "location": "x", "argument": "x", "knots": KNOTS}
    document = {"effects": [law | {"values": factor * np.cos(2 * np.pi * KNOTS / 0.03)}]}
    assert curve_error(case(missing), document) == pytest.approx(error, abs=2e-3)


@pytest.mark.parametrize(("factor", "error"), [(1.0, 0.0), (0.8, 0.2)])
def test_a_law_of_friction_acts_against_the_motion(factor, error):
    """What it says beyond a constant friction, which retuning holds."""
    law = {"name": "free_form", "location": "x", "argument": "x", "acts": "friction"}
    bound = 3.0 + factor * np.cos(2 * np.pi * KNOTS / 0.03)
    document = {"effects": [law | {"knots": KNOTS, "values": bound}]}
    assert curve_error(case([], -np.sign(SPEED) * FORCE), document) == pytest.approx(
        error, abs=2e-3
    )


@pytest.mark.parametrize(("zero", "error"), [(True, 0.1), (False, None)])
def test_a_constant_force_is_a_curve_where_a_zero_is_known(zero, error):
    law = {"name": "free_form", "location": "x", "argument": "x", "knots": KNOTS}
    document = {"effects": [law | {"values": np.full(len(KNOTS), 0.9)}]}
    found = curve_error(case([], np.ones(len(TIME)), zero), document)
    assert found == pytest.approx(error) if zero else found is None
