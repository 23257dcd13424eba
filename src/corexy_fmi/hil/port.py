"""The serial port, and what else can stand in its place."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import Protocol

import serial

from corexy_fmi.errors import InputError

BAUD = 500_000


class LinkLostError(Exception):
    """The port is gone: unplugged, or its other end closed."""


class Port(Protocol):
    """Bytes both ways and a clock [s]; ``read`` waits up to a time [s] for the first byte."""

    def read(self, wait: float) -> bytes: ...
    def write(self, data: bytes) -> None: ...
    def now(self) -> float: ...
    def reopen(self) -> bool: ...
    def close(self) -> None: ...


class SerialPort:
    """A port by its name or pyserial URL, such as /dev/ttyUSB0, COM3 or socket://host:port.

    Raises InputError where it cannot be opened, LinkLostError where it goes away.
    """

    def __init__(self, name: str, baud: int = BAUD) -> None:
        self.name, self.baud = name, baud
        self._serial = self._opened()

    def _opened(self) -> serial.SerialBase:
        try:
            # opening raises DTR, which resets an Uno: the firmware says INFO when it is up
            return serial.serial_for_url(self.name, self.baud, timeout=0, write_timeout=1)
        except (serial.SerialException, OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise InputError(f"{self.name}: {reason}, expected a serial port") from error

    def read(self, wait: float) -> bytes:
        """All bytes that are there, after at most ``wait`` [s]."""
        try:
            self._serial.timeout = wait
            first = self._serial.read(1)
            self._serial.timeout = 0
            return first + self._serial.read(4096) if first else b""
        except (serial.SerialException, OSError, TypeError) as error:
            raise LinkLostError(str(error)) from error

    def write(self, data: bytes) -> None:
        """Send all bytes."""
        try:
            self._serial.write(data)
        except (serial.SerialException, OSError, TypeError) as error:
            raise LinkLostError(str(error)) from error

    def now(self) -> float:
        """The host's steady clock [s]."""
        return time.perf_counter()

    def reopen(self) -> bool:
        """Try to get the port back."""
        self.close()
        try:
            self._serial = self._opened()
        except InputError:
            time.sleep(0.05)
            return False
        return True

    def close(self) -> None:
        """Give the port back."""
        with suppress(serial.SerialException, OSError):
            self._serial.close()
