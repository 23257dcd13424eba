"""What the numbers of GRBL 1.1 mean: alarms, errors, settings; its own `doc/csv` is the source."""

from __future__ import annotations

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
    10: "homing failed: the second switch of a dual axis was not found",
}
LOST = frozenset({1, 3, 6, 7, 8, 9, 10})  # after these the controller's position means nothing

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


def alarm(code: int) -> str:
    """An alarm in words."""
    return f"ALARM:{code} ({ALARMS.get(code, 'unknown to this version')})"


def error(code: int) -> str:
    """An error in words."""
    return f"error:{code} ({ERRORS.get(code, 'unknown to this version')})"
