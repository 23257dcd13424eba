"""The emulated board paced to real time, its UART on a pty: what a person would plug in.

`python -m tests.hil.realtime LINK [TRACKER_PORT]` makes LINK a serial port with the firmware behind
it and sends the tracker's lines of a moving FMU as UDP to 127.0.0.1.  It ends with SIGTERM;
SIGUSR1 unplugs the port for half a second, SIGUSR2 opens the e-stop.
"""

from __future__ import annotations

import os
import pty
import signal
import socket
import sys
import time
import tty
from contextlib import suppress
from pathlib import Path

from tests.hil.rig import SLICE, Rig, RigLines, Stage

UNPLUGGED = 0.5  # [s]


class Cable:
    """The pty behind a link that can be pulled."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self._back = 0.0
        self._ends: tuple[int, int] | None = None
        self.plug()

    def plug(self) -> None:
        ours, theirs = pty.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        self._ends = ours, theirs
        self.link.unlink(missing_ok=True)
        self.link.symlink_to(os.ttyname(theirs))

    def pull(self) -> None:
        for end in self._ends or ():
            os.close(end)
        self._ends = None
        self.link.unlink(missing_ok=True)
        self._back = time.monotonic() + UNPLUGGED

    def read(self) -> bytes:
        if self._ends is None:
            if time.monotonic() > self._back:
                self.plug()
            return b""
        with suppress(OSError):
            return os.read(self._ends[0], 4096)
        return b""

    def write(self, data: bytes) -> None:
        if self._ends is not None and data:
            with suppress(OSError):
                os.write(self._ends[0], data)


def serve(link: Path, tracker_port: int | None) -> None:
    """Until SIGTERM."""
    stop: list[int] = []
    pulled: list[int] = []
    pressed: list[int] = []  # a signal comes within any write: the loop does what it asks for
    signal.signal(signal.SIGTERM, lambda *_: stop.append(1))
    signal.signal(signal.SIGUSR1, lambda *_: pulled.append(1))
    signal.signal(signal.SIGUSR2, lambda *_: pressed.append(1))
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with Rig(Stage(), tracker_rate=40.0) as rig:
        cable, lines = Cable(link), RigLines(rig)
        print("ready", flush=True)
        began, slices = time.monotonic(), 0
        while not stop:
            if pulled:
                pulled.clear()
                cable.pull()
            if pressed:
                pressed.clear()
                rig.emulator.pin("C0", 1)
            data = cable.read()
            if data:
                rig.write(data)
            cable.write(rig.read(0.0))
            line = lines.read()
            if line and tracker_port:
                udp.sendto(line, ("127.0.0.1", tracker_port))
            slices += 1
            time.sleep(max(0.0, began + slices * SLICE - time.monotonic()))
        print(f"{rig.counts[0]} {rig.counts[1]}", flush=True)
        cable.link.unlink(missing_ok=True)


if __name__ == "__main__":
    serve(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else None)
