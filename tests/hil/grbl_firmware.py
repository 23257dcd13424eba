"""Whose firmware the GRBL stand-in pretends to be, and how it is set."""

from __future__ import annotations

from dataclasses import dataclass

SETTINGS = {
    0: 30, 1: 255, 10: 1, 11: 0.01, 13: 0, 20: 0, 21: 0, 22: 0, 23: 0, 27: 1.0,
    100: 101.859, 101: 101.859, 110: 12000.0, 111: 12000.0, 120: 2000.0, 121: 2000.0,
    130: 200.0, 131: 200.0,
}  # fmt: skip


FLUIDNC_TELLS = frozenset({10, 20, 21, 22, 23, 100, 101, 110, 111, 120, 121, 130, 131})


@dataclass(frozen=True)
class Firmware:
    """Whose it pretends to be.

    ``head_feed``: F is the head's speed, not that of both motors.  ``ring`` [bytes] and ``blocks``
    of its buffers; ``tells``: the settings that `$$` gives, None for all; ``tail`` of a report.
    ``unhomed``: the alarm at power-up with homing on, 0 for a lock without one.  ``talks``: after
    a critical alarm it answers reports and `$` lines, and hears a reset at once; other lines get
    ``critical``.  ``substate``: the alarm's number is in the reports.
    """

    banner: str = "Grbl 1.1h ['$' for help]"
    info: tuple[str, ...] = ("[VER:1.1h.20190830:]", "[OPT:VC,15,128]")
    head_feed: bool = False
    ring: int = 128
    blocks: int = 15
    tells: frozenset[int] | None = None
    tail: str = ""
    unhomed: int = 0
    talks: bool = False
    critical: int = 9
    substate: bool = False


GRBL = Firmware()
GRBLHAL = Firmware(  # report.c, alarms.h, errors.h of its core
    "GrblHAL 1.1f ['$' or '$HELP' for help]",
    ("[VER:1.1f.20260818:]", "[OPT:VNMCSL,35,1024,3,0]", "[AXS:3:XYZ]",
     "[NEWOPT:ENUMS,RT+,HOME,ES,REBOOT,EXPR,TC,SED]", "[FIRMWARE:grblHAL]",
     "[DRIVER:ESP32]", "[AUX IO:0,0,0,0]", "[KINEMATICS:CoreXY v2.02]"),
    head_feed=True, ring=1024, blocks=35, tail="|Ov:100,100,100|A:|H:0|FW:grblHAL", unhomed=11,
    talks=True, critical=79, substate=True,
)  # fmt: skip
FLUIDNC = Firmware(  # Report.cpp, SettingsDefinitions.cpp, Protocol.h
    "Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]",
    ("[VER:3.7 FluidNC v3.7.8:]", "[OPT:MPHSEW]", "[MSG:Machine: Core-XY]"),
    head_feed=True, ring=256, tells=FLUIDNC_TELLS, tail="|Ov:100,100,100", unhomed=14, talks=True,
)  # fmt: skip
