"""What the numbers of alarms and errors mean: GRBL 1.1's `doc/csv`.

Beyond what is common, grblHAL's `alarms.h`, `errors.h` and FluidNC's `Protocol.h`, `Error.h`.
"""

from __future__ import annotations

from corexy_fmi.hil.grbl_report import Family

ALARMS = {
    1: "hard limit switch; the place is lost",
    2: "soft limit: a target beyond the controller's travel; the place is kept",
    3: "reset in motion; the place is lost",
    4: "probe in the wrong state before its cycle",
    5: "probe did not touch within its travel",
    6: "homing failed: reset in the cycle",
    7: "homing failed: safety door opened in the cycle",
    8: "homing failed: pull-off did not clear the switch; raise $27 or check the wiring",
    9: "homing failed: no switch found in the search distance; check $130, $131 and the wiring",
}
OWN_ALARMS = {
    Family.GRBL: {10: "homing failed: the second switch of a dual axis was not found"},
    Family.GRBLHAL: {
        10: "emergency stop pressed; release it, then reset",
        11: "homing required",
        12: "a limit switch is open: move off it",
        13: "probe protection",
        14: "spindle did not come to speed",
        15: "homing failed: the second switch of an axis was not found",
        16: "self-test failed",
        17: "a motor driver reports a fault",
        18: "homing failed: bad configuration",
    },
    Family.FLUIDNC: {
        10: "spindle control failed",
        11: "a limit or control pin is active at start",
        12: "homing: both switches of an axis are active",
        13: "hard stop",
        14: "not homed",
        15: "not ready: it starts",
        16: "an expander was reset",
        17: "G-code error",
        18: "hard limit switch while probing",
    },
}
KEPT = frozenset({2, 4, 5})  # after others the controller's position means nothing

ERRORS = {
    1: "a word without its letter",
    2: "a number missing or malformed",
    3: "unknown $ command",
    4: "negative value where a positive one is expected",
    5: "homing is switched off: $22=1 and limit switches",
    6: "step pulse shorter than 3 us",
    7: "EEPROM read failed, its defaults are in force: look at every $ setting",
    8: "$ commands need an idle controller",
    9: "locked: after an alarm or at power-up; home it",
    10: "soft limits need homing: $22=1",
    11: "line too long",
    12: "setting beyond the highest step rate",
    13: "safety door open",
    14: "line too long for the EEPROM",
    15: "jog target beyond the travel",
    16: "bad jog command",
    17: "laser mode needs a PWM output",
    20: "unsupported G-code",
    21: "two G-codes of one group in a line",
    22: "no feed rate",
    23: "G-code number must be an integer",
    24: "two commands that use axis words in a line",
    25: "a word twice in a line",
    26: "no axis words in the line",
    27: "bad line number",
    28: "a value word is missing",
    29: "unsupported work coordinate system",
    30: "G53 needs G0 or G1",
    31: "axis words that nothing uses",
    32: "arc without axis words in its plane",
    33: "bad target",
    34: "bad arc radius",
    35: "arc without offsets in its plane",
    36: "value words that nothing uses",
    37: "tool length offset on the wrong axis",
    38: "tool number too large",
}
OWN_ERRORS = {
    Family.GRBL: {},
    Family.GRBLHAL: {
        18: "reset", 19: "a positive value expected", 39: "value out of range",
        43: "faster than the controller allows", 45: "a limit switch is open",
        46: "homing required", 50: "emergency stop pressed", 51: "a motor driver reports a fault",
        52: "setting out of range", 53: "setting not available", 55: "homing is set up wrong",
        79: "not allowed after this alarm: reset the controller first",
    },
    Family.FLUIDNC: {
        18: "no axis has a homing cycle", 19: "homing of one axis is not set up",
        38: "value too large", 39: "P too large", 40: "a control pin is active",
        80: "number out of range", 81: "bad value", 113: "reset",
        120: "another interface is busy", 152: "its config.yaml is invalid",
        162: "read-only setting",
    },
}  # fmt: skip


def alarm(code: int, family: Family = Family.GRBL) -> str:
    """An alarm in words."""
    words = ALARMS.get(code) or OWN_ALARMS[family].get(code, "unknown to this version")
    return f"ALARM:{code} ({words})"


def error(code: int, family: Family = Family.GRBL) -> str:
    """An error in words."""
    words = OWN_ERRORS[family].get(code) or ERRORS.get(code, "unknown to this version")
    return f"error:{code} ({words})"


def lost(code: int) -> bool:
    """Whether the controller's position means nothing after an alarm."""
    return code not in KEPT
