"""Made-up diagnoses for the report: a rectangle run with play at motor 1, in all four verdicts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from corexy_fmi.effects import catalogue
from corexy_fmi.engine.evidence import (
    CornerSize,
    Evidence,
    Finding,
    Law,
    MissingForce,
    RunnerUp,
    Spectrum,
    Trace,
)

NOISE = 2e-5  # [m]
SITES = (
    {"location": "x", "gain": 240.0, "state": "speed", "word": "speed", "probability": 0.99},
    {"location": "belts", "gain": 61.5, "state": "load", "word": "pull", "probability": 0.01},
)
VERDICTS = ("explained", "ambiguous", "unexplained", "nothing_missing")


def rectangle_path(rows: int, loops: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """80 mm by 50 mm at constant speed, counter-clockwise from bottom left [m]."""
    along = np.linspace(0, loops * 0.26, rows) % 0.26
    ends = [0, 0.08, 0.13, 0.21, 0.26]
    x = np.interp(along, ends, [-0.04, 0.04, 0.04, -0.04, -0.04])
    return x, np.interp(along, ends, [-0.025, -0.025, 0.025, 0.025, -0.025])


def lagged(
    values: np.ndarray, step: float, time_constant: float = 0.012, omega: float = 150.0
) -> np.ndarray:
    """A soft follower that rings a little after each corner."""
    decay = np.arange(0, 8 * time_constant, step)
    kernel = np.exp(-decay / time_constant) * (1 + 0.6 * np.sin(omega * decay))
    padded = np.concatenate((np.full(len(kernel), values[0]), values))
    return np.convolve(padded, kernel / kernel.sum())[len(kernel) : len(kernel) + len(values)]


def make_trace(name: str, role: str, rows: int = 10_400, tracker: int = 1, seed: int = 0) -> Trace:
    """Measured with play at motor 1 and noise; ``tracker`` > 1 measures every so many rows."""
    random = np.random.default_rng(seed)
    time = np.arange(rows) * 1e-3
    x_ref, y_ref = rectangle_path(rows, max(rows // 5200, 1))
    play = 5.2e-5 * lagged(np.sign(np.gradient(x_ref + y_ref)), 1e-3)
    clean = {"x": lagged(x_ref, 1e-3), "y": lagged(y_ref, 1e-3, 0.014, 130.0)}
    measured = {c: v - play + NOISE * random.standard_normal(rows) for c, v in clean.items()}
    for values in measured.values():
        values[np.arange(rows) % tracker > 0] = np.nan
    retuned = {c: v - 1e-5 for c, v in clean.items()}
    nominal = {"x": lagged(x_ref, 1e-3, 0.009, 170.0), "y": lagged(y_ref, 1e-3, 0.010, 150.0)}
    explained = {c: v - play for c, v in clean.items()}
    return Trace(name, role, time, measured, nominal, retuned, explained, x_ref, y_ref)


def make_evidence(verdict: str = "explained", rows: int = 10_400) -> Evidence:
    """Everything that an engine could hand over."""
    traces = (
        make_trace("train1.csv", "train", rows),
        make_trace("train2.csv", "train", rows, tracker=25, seed=1),
        make_trace("hold1.csv", "holdout", rows, seed=2),
    )
    if verdict == "nothing_missing":
        traces = tuple(replace(t, retuned=t.explained) for t in traces)
    force = 0.3 * np.sign(np.gradient(traces[0].x_ref)) * (np.sin(2.4 * traces[0].time) > 0.9)
    force = force + 0.03 * np.random.default_rng(3).standard_normal(len(force))
    missing = verdict != "nothing_missing"
    return Evidence(
        traces=traces,
        missing_forces=(MissingForce("motor1", "train1.csv", traces[0].time, force, 0.06, "N"),)
        * missing,
        laws=_laws() * missing,
        spectra=tuple(_spectrum(c) for c in "xy"),
        runners_up=_runners_up(verdict),
        corner=CornerSize(0.142, 0.031, "train1.csv") if missing else None,
        machine_name="yin2018",
    )


def _laws() -> tuple[Law, Law]:
    grid = np.linspace(-0.12, 0.12, 25)
    shape = 0.24 * np.tanh(grid / 0.02) + 0.06 * np.sin(grid * 40)
    band = 0.03 + 0.25 * grid**2
    free = Law("x", "vx", "m/s", "N", grid, shape, shape - band, shape + band, "free_form")
    named = 0.25 * np.tanh(grid / 0.02)
    return free, replace(
        free, value=named, lower=named - 0.008, upper=named + 0.008, source="effect"
    )


def _spectrum(channel: str) -> Spectrum:
    random = np.random.default_rng(4)
    frequency = np.linspace(0, 500, 4001)
    noise = np.full(4001, 9e-7)
    rough = np.exp(0.25 * random.standard_normal((2, 4001)))
    excess = 4e-5 / (1 + (frequency / 3) ** 2)
    return Spectrum(channel, frequency, (noise + excess) * rough[0], noise * 1.02 * rough[1], noise)


def _runners_up(verdict: str) -> tuple[RunnerUp, ...]:
    if verdict == "nothing_missing":
        return (
            RunnerUp("retuned_parameters", "", 0.993, 0.0, NOISE),
            RunnerUp(
                "tooth_ripple", "motor2", 0.004, 1.2, NOISE * 1.001, "gain below the threshold"
            ),
        )
    shares = (0.998, 0.0016, 2e-4, 1e-7) if verdict == "explained" else (0.53, 0.46, 0.01, 1e-6)
    names = (
        ("backlash", "motor1"),
        ("stribeck_friction", "xy"),
        ("axis_skew", "sensor"),
        ("racking", "bridge"),
    )
    gains = (412.3, 405.9, 371.0, 98.4)
    return tuple(
        RunnerUp(*n, p, g, NOISE * (1.01 + 0.2 * i), "" if i < 2 else "fitted briefly: far behind")
        for i, (n, p, g) in enumerate(zip(names, shares, gains, strict=True))
    )


def effect_entry() -> dict[str, Any]:
    """One entry of ``effects`` (CONTRACT 4)."""
    known = catalogue()["backlash"]
    return {
        "name": "backlash",
        "location": "motor1",
        "probability": 0.998,
        "parameters": {
            "gap": {"value": 0.0208, "unit": "rad", "ci95": [0.0203, 0.0213]},
            "grip": {"value": 1.3e-3, "unit": "N m", "ci95": [4e-4, 4.1e-3]},
        },
        "alternatives": [{"name": "stribeck_friction", "location": "xy", "probability": 0.0016}],
        "equation": known.equation,
        "citation": known.citation,
        "remedy": known.remedy,
        "check": known.check,
    }


def _fit(verdict: str) -> list[dict[str, Any]]:
    rows = []
    for name, role in (("train1.csv", "train"), ("train2.csv", "train"), ("hold1.csv", "holdout")):
        for channel, given in (("x", 1.13e-4), ("y", 9.4e-5)):
            left = 2.02e-5 if verdict == "nothing_missing" else 5.6e-5
            rows.append(
                {
                    "recording": name,
                    "role": role,
                    "channel": channel,
                    "noise_std": NOISE,
                    "rms_nominal": given,
                    "rms_retuned": left,
                    "rms_explained": 2.02e-5,
                    "whiteness_p": 0.41,
                }
            )
    return rows


def make_document(verdict: str = "explained") -> dict[str, Any]:
    """``diagnosis.json`` (CONTRACT 4) of a verdict."""
    effect = effect_entry()
    nothing = verdict == "nothing_missing"
    if verdict == "unexplained":
        effect |= {
            "name": "free_form",
            "location": "x",
            "remedy": "",
            "check": "",
            "parameters": {},
            "citation": "",
            "equation": r"F = \mathrm{interp}(v_x;\ \mathrm{knots}, \mathrm{values})",
            "description": "a force on x that depends on vx, +-0.24 N over the range seen",
        }
    retuned = {
        "carriage_mass": {
            "value": 0.26,
            "unit": "kg",
            "ci95": [0.25, 0.27],
            "pull": 0.6,
            "prior_driven": False,
        },
        "bridge_mass": {
            "value": 0.192,
            "unit": "kg",
            "ci95": [0.17, 0.214],
            "pull": -0.2,
            "prior_driven": True,
        },
        "belt_axial_stiffness": {
            "value": 910.0,
            "unit": "N",
            "ci95": [904.0, 916.0],
            "pull": 0.17,
            "prior_driven": False,
        },
        "carriage_viscous_friction": {
            "value": 71.3,
            "unit": "N s/m",
            "ci95": [70.9, 71.8],
            "pull": 0.94,
            "prior_driven": False,
        },
        "pulley_coulomb_friction": {
            "value": 2.6e-4,
            "unit": "N m",
            "ci95": [2.4e-4, 2.8e-4],
            "pull": -1.5,
            "prior_driven": False,
        },
    }
    left = 2.02e-5 if nothing else 5.7e-5
    pair = [
        {"name": "backlash", "location": "motor1"},
        {"name": "stribeck_friction", "location": "xy"},
    ]
    why = "slow reversals part play, which opens at once, from breakaway friction"
    return {
        "schema": 1,
        "verdict": verdict,
        "effects": [] if nothing else [effect],
        "ambiguous_between": [pair] if verdict == "ambiguous" else [],
        "next_experiment": {"why": why, "program": "next.csv"} if verdict == "ambiguous" else None,
        "located": {
            "coordinate": None if nothing else "x" if verdict == "unexplained" else "motor1",
            "state": None if nothing else "velocity_reversal",
            "time": []
            if nothing
            else [["train1.csv", 1.55, 1.85, 0.31], ["train1.csv", 4.15, 4.4, 0.22]],
            "path": [],
            "frequency": [0.0, 40.0],
            "confidence": 0.99,
            "sites": [] if nothing else list(SITES),
        },
        "fit": _fit(verdict),
        "heldout": {
            "rms_nominal": 1.04e-4,
            "rms_retuned": left,
            "rms_explained": 2.02e-5,
            "noise_std": NOISE,
            "excess_removed": 0.0 if nothing else 0.974,
            "weak": False,
        },
        "retuned": retuned,
        "not_excluded": [
            {
                "name": "backlash",
                "location": "motor2",
                "parameter": "gap",
                "upper95": 0.002,
                "unit": "rad",
            },
            {
                "name": "belt_mismatch",
                "location": "belts",
                "parameter": "ratio",
                "upper95": 0.013,
                "unit": "1",
            },
            {
                "name": "stribeck_friction",
                "location": "x",
                "parameter": "static_ratio",
                "upper95": 1.07,
                "unit": "1",
            },
            {
                "name": "sensor_delay",
                "location": "sensor",
                "parameter": "delay",
                "upper95": 8.3e-5,
                "unit": "s",
            },
            {
                "name": "pulley_eccentricity",
                "location": "pulley7",
                "parameter": "amplitude",
                "upper95": 3.1e-6,
                "unit": "m",
            },
        ],
        "machine_assumed": False,
        "seconds": 1.93,
    }


def warned(document: dict[str, Any], evidence: Evidence) -> tuple[dict[str, Any], Evidence]:
    """The same with everything to warn of."""
    retuned = document["retuned"] | {
        "motor_inertia": {
            "value": 8.9e-6,
            "unit": "kg m^2",
            "ci95": [8.1e-6, 9.7e-6],
            "pull": 4.1,
            "prior_driven": False,
        }
    }
    document = document | {"machine_assumed": True, "retuned": retuned}
    document["heldout"] = document["heldout"] | {"weak": True}
    found = Finding(
        "train2.csv: x and y are given in mm", "Divide both by 1000; it is undone here."
    )
    note = "geometry and friction are assumed, the paper does not print them"
    return document, replace(evidence, preflight=(found,), surrogate=note)
