"""A second source: lines ``t x y`` [s, m, m] over a serial port or UDP, on a clock of its own."""

from __future__ import annotations

import contextlib
import math
import socket
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.errors import InputError
from corexy_fmi.hil.clock import lower_envelope
from corexy_fmi.hil.port import LinkLostError, Port, SerialPort

Array = NDArray[np.float64]
TRACKER_BAUD, LAST_PORT = 115_200, 65_535


class Lines(Protocol):
    """Bytes as they arrive, without waiting."""

    def read(self) -> bytes: ...


class SerialLines:
    """A tracker at a serial port; one that goes away falls silent, which the tracker counts."""

    def __init__(self, port: Port) -> None:
        self._port = port

    def read(self) -> bytes:
        """What has arrived."""
        with contextlib.suppress(LinkLostError):
            return self._port.read(0.0)
        return b""


class UdpLines:
    """Datagrams of one or more lines, at a local address."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            raise InputError(f"udp://{host}:{port}: {error.strerror}, expected a free port"
                             ) from error  # fmt: skip
        self._socket.setblocking(False)

    def read(self) -> bytes:
        """What has arrived."""
        data = b""
        with contextlib.suppress(BlockingIOError):
            while True:
                data += self._socket.recv(65536) + b"\n"
        return data


def open_lines(address: str, baud: int = TRACKER_BAUD) -> Lines:
    """The tracker at ``udp://host:port`` or a serial port; InputError where there is none."""
    if not address.startswith("udp://"):
        return SerialLines(SerialPort(address, baud))
    host, colon, port = address.removeprefix("udp://").rpartition(":")
    if not colon or not port.isdigit() or int(port) > LAST_PORT:
        raise InputError(f"tracker: found {address!r}, expected udp://host:port or a serial port")
    return UdpLines(host or "0.0.0.0", int(port))


class Tracker:
    """Collects samples with the host's time of arrival; ``bad`` counts lines that are none."""

    def __init__(self, lines: Lines) -> None:
        self._lines = lines
        self._rest = b""
        self.samples: list[tuple[float, float, float, float]] = []
        self.bad = 0

    def poll(self, now: float) -> None:
        """Take what has arrived by the host's time ``now`` [s]."""
        data = self._lines.read()
        if not data:
            return
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            if line.strip():
                self._take(line, now)

    def _take(self, line: bytes, now: float) -> None:
        try:
            stamp, x, y = (float(word) for word in line.replace(b",", b" ").split())
        except ValueError:
            self.bad += 1
            return
        late = self.samples and stamp <= self.samples[-1][1]
        if late or not all(map(math.isfinite, (stamp, x, y))):
            self.bad += 1
        else:
            self.samples.append((now, stamp, x, y))

    def aligned(self) -> tuple[Array, Array]:
        """Host times (n,) [s] at which the samples were taken, and x, y (n, 2) [m].

        As far as arrivals tell: a latency that all samples share stays in the times.
        """
        if not self.samples:
            return np.empty(0), np.empty((0, 2))
        table = np.array(self.samples)
        offset, rate = lower_envelope(table[:, 1], table[:, 0])
        return offset + rate * table[:, 1], table[:, 2:]
