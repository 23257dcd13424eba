"""A whole diagnosis.json as the contract shows it, for tests that need one."""

from __future__ import annotations

import copy
from typing import Any

EXAMPLE: dict[str, Any] = {
    "schema": 1,
    "verdict": "explained",
    "effects": [
        {
            "name": "backlash",
            "location": "motor1",
            "probability": 0.998,
            "parameters": {"gap": {"value": 0.021, "unit": "rad", "ci95": [0.020, 0.022]}},
            "alternatives": [
                {"name": "presliding_hysteresis", "location": "x", "probability": 0.002}
            ],
            "equation": r"|d| \leq r g / 2",
            "citation": "Nordin, Gutman 2002",
            "remedy": "Tighten the set screw.",
            "check": "Turn the pulley by hand.",
        }
    ],
    "ambiguous_between": [],
    "next_experiment": {"why": "reversals of one motor", "program": "next.csv"},
    "located": {
        "coordinate": "motor1",
        "state": "velocity_reversal",
        "time": [["train1.csv", 1.2, 1.4, 0.31]],
        "path": [[0.03, 0.01, 0.31]],
        "frequency": [0.0, 40.0],
        "confidence": 0.99,
    },
    "fit": [
        {
            "recording": "train1.csv",
            "role": "train",
            "channel": "x",
            "noise_std": 2e-5,
            "rms_nominal": 1.1e-4,
            "rms_retuned": 4e-5,
            "rms_explained": 2.02e-5,
            "whiteness_p": 0.4,
        }
    ],
    "heldout": {
        "rms_nominal": 1.0e-4,
        "rms_retuned": 4.1e-5,
        "rms_explained": 2.1e-5,
        "noise_std": 2e-5,
        "excess_removed": 0.9679936,
        "weak": False,
    },
    "retuned": {
        "carriage_mass": {
            "value": 0.26,
            "unit": "kg",
            "ci95": [0.25, 0.27],
            "pull": 0.6,
            "prior_driven": False,
        }
    },
    "not_excluded": [
        {
            "name": "backlash",
            "location": "motor2",
            "parameter": "gap",
            "upper95": 0.002,
            "unit": "rad",
        }
    ],
    "machine_assumed": False,
    "seconds": 1.9,
}


def example() -> dict[str, Any]:
    """A copy of its own."""
    return copy.deepcopy(EXAMPLE)
