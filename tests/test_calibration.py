"""Calibration of the proof's outcomes: counted by hand on made-up ones."""

from __future__ import annotations

from typing import Any

import pytest

from benchmarks.concealed import calibration


def entry(said: float, ci: tuple[float, float], place: str = "y", **truth: Any) -> dict[str, Any]:
    """A case with a friction peak planted on y, named with probability ``said``."""
    effect = {"name": "stribeck_friction", "location": place, "probability": said}
    effect["parameters"] = {"speed": {"value": sum(ci) / 2, "ci95": list(ci)}}
    planted = {"name": "stribeck_friction", "location": "y", "parameters": {"speed": 0.01}}
    return {
        "outcome": "right" if place == "y" else "wrong",
        "truth": {"kind": "effect", "E": 1000.0, "effects": [planted]} | truth,
        "document": {
            "effects": [effect],
            "located": {"coordinate": place, "state": "velocity_reversal"},
        },
    }


CASES = [entry(0.95, (0.009, 0.011)), entry(0.995, (0.0101, 0.011)), entry(0.6, (0.0, 1.0), "x")]


def test_a_place_counts_where_the_effect_could_be_seen() -> None:
    """Three cases, two places, three variables; weak cases and nulls do not count."""
    others = [entry(1.0, (0, 1), E=200.0), entry(1.0, (0, 1), kind="null")]
    assert calibration.located(CASES + others) == (3, 2, 3)


def test_half_of_a_shared_place_is_right() -> None:
    """x of a planted xy."""
    case = entry(0.9, (0, 1), "x")
    case["truth"]["effects"][0]["location"] = "xy"
    assert calibration.located([case])[1] == 1


def test_brier_score_by_hand() -> None:
    """(0.05^2 + 0.005^2 + 0.6^2) / 3."""
    score = calibration.brier(calibration.named(CASES))
    assert score == pytest.approx((0.05**2 + 0.005**2 + 0.6**2) / 3)


def test_intervals_of_rightly_named_effects_count() -> None:
    """The wrongly placed case does not."""
    assert calibration.coverage(CASES) == {("stribeck_friction", "speed"): [True, False]}


def test_a_phase_is_the_same_a_turn_later() -> None:
    """-3.1 rad lies in (3.1, 3.3)."""
    case = entry(1.0, (3.1, 3.3))
    case["document"]["effects"][0]["parameters"] = {"phase": {"value": 3.2, "ci95": [3.1, 3.3]}}
    case["truth"]["effects"][0]["parameters"] = {"phase": -3.1}
    assert list(calibration.coverage([case]).values()) == [[True]]


def test_steps_that_are_missing_are_a_jump_back() -> None:
    """Two steps lost, in the plant's count, are a jump by -2."""
    case = entry(1.0, (0.0, 1.0))
    said = {"steps@a.csv": {"value": -2.0, "ci95": [-2.1, -1.9]}}
    case["document"]["effects"][0]["parameters"] = said
    case["truth"]["effects"][0]["parameters"] = {"steps@a.csv": 2.0}
    assert list(calibration.coverage([case]).values()) == [[True]]


@pytest.mark.parametrize(("law", "own"), [(0.0, True), (1.0, False), (2.0, True)])
def test_a_form_that_the_catalogue_lacks_is_told_apart(law: float, own: bool) -> None:
    """The Lorentzian peak is the plant's alone."""
    case = entry(1.0, (0.0, 1.0))
    case["truth"]["effects"][0]["form"] = {"law": law}
    assert calibration.in_own_form(case) is own


def test_the_section_prints_its_counts() -> None:
    """n beside every share."""
    text = "\n".join(calibration.section(CASES))
    assert "2/3" in text
    assert "1/2" in text
    assert "| 0.9 .. 0.99 | 1 |" in text


def test_a_probability_that_rounded_beyond_one_is_counted() -> None:
    page = "\n".join(calibration.section([entry(1.0 + 2e-16, (0.0, 1.0))]))
    assert "| 0.99 .. 1.0 | 1 |" in page


def test_an_arm_beside_the_relaxed_belt_is_a_share_of_the_quick_one() -> None:
    """An arm a fourth as stiff as the relaxed belt is a fifth of what a quick load meets."""
    case = entry(1.0, (0.0, 1.0))
    said = {"ratio": {"value": 0.2, "ci95": [0.19, 0.21]}}
    case["document"]["effects"][0]["parameters"] = said
    case["truth"]["effects"][0] |= {"name": "belt_relaxation", "parameters": {"ratio": 0.25}}
    assert list(calibration.coverage([case]).values()) == [[True]]


@pytest.mark.parametrize("fitted", [True, False])
def test_pulses_of_the_plant_are_twice_their_amplitude_high(fitted: bool) -> None:
    """Half a period long, they begin at the sine's zero; what was told as a sine has no pulses."""
    case = entry(1.0, (0.0, 1.0))
    said = {"amplitude": {"value": 0.2, "ci95": [0.19, 0.21]}} | {
        "phase@a.csv": {"value": 0.0, "ci95": [-0.1, 0.1]}
    }
    duty = {"duty": {"value": 0.5, "ci95": [0.4, 0.6]}} if fitted else {}
    case["document"]["effects"][0]["parameters"] = said | duty
    case["truth"]["effects"][0] |= {
        "name": "periodic_disturbance",
        "parameters": {"amplitude": 0.1, "phase@a.csv": 0.0},
        "form": {"duty": 0.5},
    }
    held = calibration.coverage([case])
    assert held[("periodic_disturbance", "amplitude")] == [fitted]


def test_the_plants_pulse_has_its_middle_where_its_sine_is_largest() -> None:
    """A pulse of 0.3 of a period about the quarter begins at 0.1 of it."""
    planted = {"name": "periodic_disturbance", "parameters": {"phase": 0.0}, "form": {"duty": 0.3}}
    begins = calibration.as_catalogued(planted, "phase", {"duty": 0.3})
    assert begins == pytest.approx(-0.1 * calibration.PERIOD)
