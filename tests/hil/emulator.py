"""The firmware on an emulated board: built, run in a process of its own, driven in lock-step."""

from __future__ import annotations

import atexit
import shutil
import struct
import subprocess
import tempfile
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
FREQUENCY = 16_000_000  # [Hz]
TICK = 640  # [cycles] of the stepper firmware
EDGE = np.dtype(
    [("cycle", "<u8"), ("port", "u1"), ("bit", "u1"), ("level", "u1"), ("zero", "u1"),
     ("count", "<i4")]
)  # fmt: skip
INCLUDES = (Path("/usr/include"), Path("/usr/local/include"))
INSTALL = "apt-get install gcc-avr avr-libc libsimavr-dev simavr libelf-dev"
_HEAD = struct.Struct("<BQiiIIBI")


def missing() -> str:
    """What the system lacks for an emulated board, empty if nothing."""
    lacks = [] if shutil.which("avr-gcc") and shutil.which("make") else ["avr-gcc"]
    simavr = any((place / "simavr/sim_avr.h").exists() for place in INCLUDES)
    lacks += [] if simavr and shutil.which("gcc") else ["libsimavr"]
    return " and ".join(lacks)


@cache
def folder() -> Path:
    """Where what is built lies, gone when the tests end."""
    made = Path(tempfile.mkdtemp(prefix="corexy-hil-"))
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    return made


@cache
def board_program() -> Path:
    """The emulated board, compiled."""
    source, program = Path(__file__).with_name("emulated_board.c"), folder() / "emulated_board"
    include = [f"-I{place}/simavr" for place in INCLUDES]
    _call("gcc", "-O2", *include, str(source), "-o", str(program), "-lsimavr", "-lelf")
    return program


@cache
def firmware_elf(name: str) -> Path:
    """The firmware "stepper" or "dc", compiled."""
    elf = folder() / f"{name}.elf"
    _call("make", "-s", "-C", str(ROOT / "firmware"), f"OUT={folder()}", str(elf))
    return elf


def _call(*words: str) -> None:
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout}{done.stderr}"


@dataclass
class Ran:
    """What one stretch of emulation gave: UART bytes, counts and edges of the step pins."""

    state: int
    cycle: int
    counts: tuple[int, int]
    duties: tuple[int, int]  # [1/65536]
    port_d: int
    data: bytes
    edges: NDArray[np.void] = field(repr=False)


class Emulator:
    """An ATmega328P with a firmware, "stepper" or "dc"; its switches are closed, as they should."""

    def __init__(self, firmware: str = "stepper") -> None:
        self.elf = firmware_elf(firmware)
        self._process = subprocess.Popen(
            [board_program(), self.elf], stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._in, self._out = self._process.stdin, self._process.stdout
        self.cycle = 0
        self.run(1e-4)  # the firmware sets its pull-ups before the switches are read
        encoders = ("C0", "C1", "C2", "C3")  # both at count 0
        closed = ("C0", "B1", "B2") if firmware == "stepper" else ("D4", "D2", "D3", *encoders)
        for pin in closed:
            self.pin(pin, 0)

    @property
    def time(self) -> float:
        """Emulated time [s]."""
        return self.cycle / FREQUENCY

    def run(self, seconds: float) -> Ran:
        """Go on for a time [s]."""
        return self.run_to(self.cycle + round(seconds * FREQUENCY))

    def run_to(self, cycle: int) -> Ran:
        """Go on to a CPU cycle, or a few beyond."""
        self._in.write(b"R" + struct.pack("<Q", cycle))
        self._in.flush()
        head = _HEAD.unpack(self._out.read(_HEAD.size))
        data = self._out.read(head[7])
        (count,) = struct.unpack("<I", self._out.read(4))
        edges = np.frombuffer(self._out.read(count * EDGE.itemsize), EDGE)
        self.cycle = head[1]
        return Ran(head[0], head[1], head[2:4], head[4:6], head[6], data, edges)

    def write(self, data: bytes) -> None:
        """Bytes into the UART."""
        self._in.write(b"W" + struct.pack("<I", len(data)) + data)

    def pin(self, name: str, level: int) -> None:
        """Drive an input such as "C0"."""
        self._in.write(struct.pack("<cBBB", b"P", ord(name[0]), int(name[1]), level))

    def encoders(self, a: int, b: int) -> None:
        """Counts that the quadrature encoders reach, evenly, during the next run."""
        self._in.write(struct.pack("<cii", b"E", a, b))

    def reset(self) -> None:
        """The reset pin."""
        self._in.write(b"X")

    def memory(self, symbol: str, size: int) -> bytes:
        """A variable of the firmware."""
        self._in.write(struct.pack("<cHB", b"G", self._address(symbol), size))
        self._in.flush()
        return self._out.read(size)

    def memory_at(self, address: int) -> int:
        """One byte of data memory, such as a port's register."""
        self._in.write(struct.pack("<cHB", b"G", address, 1))
        self._in.flush()
        return self._out.read(1)[0]

    def poke(self, symbol: str, data: bytes) -> None:
        """Change a variable of the firmware."""
        for offset, value in enumerate(data):
            self.poke_at(self._address(symbol) + offset, value)

    def poke_at(self, address: int, value: int) -> None:
        """Change one byte of data memory."""
        self._in.write(struct.pack("<cHB", b"S", address, value))

    def _address(self, symbol: str) -> int:
        known = _symbols(self.elf)
        numbered = [name for name in known if name.startswith(f"{symbol}.")]  # static in a function
        return known[symbol if symbol in known else numbered[0]] & 0xFFFF

    def close(self) -> None:
        """End the process."""
        self._in.close()
        self._process.wait(timeout=10)
        self._out.close()

    def __enter__(self) -> Emulator:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


@cache
def _symbols(elf: Path) -> dict[str, int]:
    names = subprocess.run(["avr-nm", elf], capture_output=True, text=True, check=True).stdout
    rows = (line.split() for line in names.splitlines())
    return {row[2]: int(row[0], 16) for row in rows if len(row) == 3}
