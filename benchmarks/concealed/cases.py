"""The cases of the published proof: which effect, setting, strength and noise has which seed."""

from __future__ import annotations

import hashlib
from typing import Any

EFFECTS = (
    "stribeck_friction",
    "backlash",
    "belt_mismatch",
    "constant_force",
    "belt_stiffness_vs_position",
    "pulley_eccentricity",
    "stepper_compliance",
    "sensor_delay",
    "axis_skew",
    "tool_mode",
)
MORE = (
    "presliding_hysteresis",
    "friction_vs_position",
    "load_friction",
    "quadratic_drag",
    "friction_warmup",
    "belt_slack",
    "belt_damping",
    "belt_hardening",
    "belt_relaxation",
    "tooth_ripple",
    "detent_torque",
    "microstep_error",
    "missed_steps",
    "winding_lag",
    "driver_deadband",
    "supply_saturation",
    "torque_ripple",
    "racking",
    "frame_mode",
    "cable_drag",
    "periodic_disturbance",
    "sensor_rotation",
    "sensor_scale",
    "sensor_lag",
    "clock_drift",
)
CATALOGUES = {"ten": EFFECTS, "full": EFFECTS + MORE}
SETTINGS = ("commissioning", "rectangles", "dc")
STEPPER_ONLY = ("stepper_compliance", "microstep_error", "missed_steps")
DC_ONLY = ("winding_lag", "driver_deadband", "supply_saturation", "torque_ripple")
STRENGTHS = (1000.0, 300.0)
NOISES = ({"rho": 0.0}, {"rho": 0.8})  # white, and AR(1)-coloured
DIRTY = {"rho": 0.0, "dropout": 0.02, "spikes": 0.002, "missing": 0.005}


def seed_of(origin: str, name: str) -> int:
    """A seed that the author cannot choose: from an origin (a commit's hash) and a case's name."""
    return int(hashlib.sha256(f"{origin}:{name}".encode()).hexdigest()[:8], 16)


def _setting(effect: str, n: int) -> str:
    setting = "dc" if effect in DC_ONLY else SETTINGS[n % len(SETTINGS)]
    return "commissioning" if setting == "dc" and effect in STEPPER_ONLY else setting


def effect_cases(repeats: int, catalogue: str = "ten") -> list[tuple[str, dict[str, Any]]]:
    """Named cases with one effect: every effect in turn, so a prefix is balanced."""
    cases = []
    noises = NOISES if catalogue == "ten" else (*NOISES, DIRTY)
    for n in range(repeats):
        for effect in CATALOGUES[catalogue]:
            target = STRENGTHS[n % 4 == 3]
            wanted = {
                "kind": "effect",
                "effect": effect,
                "setting": _setting(effect, n),
                "target_E": target,
                "noise": noises[(n // 2) % len(noises)],
            }
            cases.append((f"{effect}-{n}", wanted))
    return cases


def strikes(name: str) -> bool:
    """Whether a case is diagnosed once more with its true entry deleted: every fourth of each."""
    effect, _, n = name.rpartition("-")
    return effect in CATALOGUES["full"] and int(n) % 4 == 0


def null_cases(count: int) -> list[tuple[str, dict[str, Any]]]:
    """Named cases with nothing planted, nuisances imperfect as the plant draws them."""
    return [(f"null-{n}", {"kind": "null", "setting": SETTINGS[n % 3]}) for n in range(count)]


def other_cases(count: int) -> list[tuple[str, dict[str, Any]]]:
    """Pairs and causes outside the catalogue."""
    kinds = ("pair", "outside")
    return [(f"{k}-{n}", {"kind": k, "target_E": 1000.0}) for n in range(count) for k in kinds]


def published(
    effects: int, nulls: int, others: int, catalogue: str = "ten"
) -> list[tuple[str, dict[str, Any]]]:
    """All cases, interleaved, so that a run that is cut short is still balanced."""
    lists = [effect_cases(effects, catalogue), null_cases(nulls), other_cases(others)]
    if catalogue != "ten":
        lists = [[(name, w | {"catalogue": catalogue}) for name, w in group] for group in lists]
    total = [
        (k / max(len(group), 1), i, case)
        for i, group in enumerate(lists)
        for k, case in enumerate(group)
    ]
    return [case for _, _, case in sorted(total, key=lambda item: item[:2])]
