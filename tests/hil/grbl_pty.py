"""The GRBL stand-in in real time, on a serial port: what a person would plug in.

`python -m tests.hil.grbl_pty LINK [--family grbl|grblhal|fluidnc] [--set N=VALUE ...]` makes LINK a
serial port with it.  It ends with SIGTERM and prints a line of JSON: counts, steps and lost bytes.
SIGUSR1 unplugs the port for half a second.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import time
from pathlib import Path

from tests.hil.grbl_firmware import FLUIDNC, GRBL, GRBLHAL
from tests.hil.grbl_stand_in import StandIn
from tests.hil.realtime import Cable

FAMILIES = {"grbl": GRBL, "grblhal": GRBLHAL, "fluidnc": FLUIDNC}


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("link", type=Path)
    parser.add_argument("--family", choices=FAMILIES, default="grbl")
    parser.add_argument("--set", nargs="*", default=[], metavar="N=VALUE")
    words = parser.parse_args()
    settings = {int(n): float(v) for n, v in (text.split("=") for text in words.set)}
    controller, cable = StandIn(FAMILIES[words.family], settings), Cable(words.link)
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda *_: ended.append(1))
    pulled: list[int] = []
    signal.signal(signal.SIGUSR1, lambda *_: pulled.append(1))
    print("ready", flush=True)
    began = time.perf_counter()
    while not ended:
        if pulled:
            pulled.clear()
            cable.pull()
        controller.write(cable.read())
        late = time.perf_counter() - began - controller.time
        if late > 0:
            controller.advance(late)
        cable.write(controller.read())
        time.sleep(1e-3)
    motion = controller.motion
    told = {"counts": motion.counts, "emitted": motion.emitted}
    json.dump({**told, "overflowed": controller.overflowed, "state": controller.state}, sys.stdout)


if __name__ == "__main__":
    main()
