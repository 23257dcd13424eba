"""The little G-code that the GRBL stand-in reads, with GRBL's error numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

WORD = re.compile(r"([A-Z])([-+]?[0-9]*\.?[0-9]+)")
KNOWN = {1, 4, 17, 21, 90, 91, 93, 94}
LETTER, NUMBER, UNSUPPORTED, NO_FEED, TWICE, NO_VALUE = 1, 2, 20, 22, 25, 28


@dataclass(frozen=True)
class Rest:
    """G4 [s]."""

    seconds: float


@dataclass(frozen=True)
class Way:
    """G1: x, y [mm] as far as given, F [mm/min, or 1/min if inverse]."""

    to: tuple[float | None, float | None]
    feed: float
    inverse: bool
    relative: bool


@dataclass
class Reader:
    """What is modal: G90 or G91, G93 or G94, F."""

    modes: dict[str, bool] = field(default_factory=lambda: {"G93": False, "G91": False})
    feed: float | None = None

    def read(self, line: str) -> Rest | Way | int:
        """What a line wants, or its code: 0 for one that moves nothing."""
        words = WORD.findall(line)
        if "".join(a + b for a, b in words) != line:
            return NUMBER if line[0].isalpha() else LETTER
        values = {a: float(b) for a, b in words if a != "G"}
        codes = [float(b) for a, b in words if a == "G"]
        if len(values) + len(codes) != len(words):
            return TWICE
        if set(codes) - KNOWN or set(values) - set("FPXY"):
            return UNSUPPORTED
        for on, off, name in ((93, 94, "G93"), (91, 90, "G91")):
            if on in codes or off in codes:
                self.modes[name] = on in codes
        if 4 in codes:
            return Rest(values["P"]) if "P" in values else NO_VALUE
        return self._way(values)

    def _way(self, values: dict[str, float]) -> Way | int:
        inverse = self.modes["G93"]
        feed = values.get("F", None if inverse else self.feed)
        self.feed = self.feed if inverse else feed
        if "X" not in values and "Y" not in values:
            return 0
        if feed is None:
            return NO_FEED
        return Way((values.get("X"), values.get("Y")), feed, inverse, self.modes["G91"])
