"""Whose firmware the GRBL stand-in pretends to be, and how it is set."""

from __future__ import annotations

from dataclasses import dataclass

SETTINGS = {
    0: 30, 1: 255, 10: 1, 11: 0.01, 13: 0, 20: 0, 21: 0, 22: 0, 23: 0, 27: 1.0,
    100: 101.859, 101: 101.859, 110: 12000.0, 111: 12000.0, 120: 2000.0, 121: 2000.0,
    130: 200.0, 131: 200.0,
}  # fmt: skip


@dataclass(frozen=True)
class Firmware:
    """Whose it pretends to be; ``head_feed``: F is the head's speed, not that of both motors."""

    banner: str = "Grbl 1.1h ['$' for help]"
    info: tuple[str, ...] = ("[VER:1.1h.20190830:]", "[OPT:VC,15,128]")
    head_feed: bool = False


GRBL = Firmware()
GRBLHAL = Firmware(
    "GrblHAL 1.1f ['$' or '$HELP' for help]",
    ("[VER:1.1f.20260818:]", "[OPT:VNMCSL,15,128,3,0]", "[FIRMWARE:grblHAL]",
     "[KINEMATICS:CoreXY v2.02]"),
    head_feed=True,
)  # fmt: skip
FLUIDNC = Firmware(
    "Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]",
    ("[VER:3.7 FluidNC v3.7.8:]", "[OPT:MPHSEW]"),
    head_feed=True,
)
