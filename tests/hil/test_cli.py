"""The command line on the emulated board in real time: exactness and words, never speed."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from corexy_fmi.recording import read_recording
from tests.hil.emulator import ROOT

SMALL = ("--width", "0.01", "--height", "0.008", "--speed", "0.039")
SILENCE = "3.0"  # [s]: a test machine may be busy, and the board runs in real time
PATIENCE = 60
# where the machine stalls for longer than the board's queue lasts, the board says so and stops
pytestmark = pytest.mark.flaky(reruns=2, only_rerun=["the host or link was too slow"])


@dataclass
class Plugged:
    """A serial port with the board behind it, and the UDP address of its tracker."""

    port: str
    tracker: str
    process: subprocess.Popen[str]

    def corexy(self, *words: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-m", "corexy_fmi", "hil", *words, "--port", self.port],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # shells may ignore it
        )  # fmt: skip

    def drive(self, out: Path, *words: str) -> subprocess.Popen[str]:
        fixed = (*SMALL, "--centred", "--watchdog", SILENCE)
        return self.corexy("rectangle", *fixed, "--out", str(out), *words)


@pytest.fixture
def plugged(tmp_path: Path) -> Iterator[Plugged]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        number = free.getsockname()[1]
    link = tmp_path / "port"
    with subprocess.Popen(
        [sys.executable, "-m", "tests.hil.realtime", str(link), str(number)],
        stdout=subprocess.PIPE, text=True, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)},
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        yield Plugged(str(link), f"udp://127.0.0.1:{number}", process)
        process.terminate()
        process.communicate(timeout=PATIENCE)


def test_rectangle_is_driven_and_recorded(plugged: Plugged, tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    done = plugged.drive(out, "--arm", "--tracker", plugged.tracker, "--beside", "--loops", "2")
    said, complained = done.communicate(timeout=PATIENCE)
    assert done.returncode == 0, complained
    assert "every commanded step counted" in said
    made = read_recording(out)
    assert made.metadata["run"] == "complete"
    assert made.metadata["commanded"] == made.metadata["counted"]
    assert made.measured == ("x", "y")
    assert "rms_x" in made.metadata["beside_fmu"]
    assert not out.with_name("run.part.csv").exists()
    plugged.process.terminate()
    pins = plugged.process.communicate(timeout=PATIENCE)[0].split()
    assert " ".join(pins) == made.metadata["commanded"]


def test_nothing_moves_without_arm(plugged: Plugged, tmp_path: Path) -> None:
    done = plugged.drive(tmp_path / "run.csv")
    said, _ = done.communicate(timeout=PATIENCE)
    assert done.returncode == 0
    assert "nothing moves" in said
    plugged.process.terminate()
    assert plugged.process.communicate(timeout=PATIENCE)[0] == "0 0\n"


def test_an_absent_port_is_one_line() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "corexy_fmi", "hil", "check", "--port", "nowhere"],
        capture_output=True, text=True, cwd=ROOT,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("nowhere: ")
    assert done.stderr.count("\n") == 1


def test_interrupt_ramps_down_and_says_where(plugged: Plugged, tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    done = plugged.drive(out, "--arm", "--loops", "20")
    _await_rows(tmp_path / "run.part.csv")
    done.send_signal(signal.SIGINT)
    said, complained = done.communicate(timeout=PATIENCE)
    assert done.returncode == 3, complained
    assert "the carriage is at x =" in said
    assert read_recording(out).metadata["run"] == "interrupted"


def test_a_killed_host_leaves_a_recording(plugged: Plugged, tmp_path: Path) -> None:
    part = tmp_path / "run.part.csv"
    done = plugged.drive(tmp_path / "run.csv", "--arm", "--loops", "20")
    _await_rows(part)
    done.kill()
    done.communicate(timeout=PATIENCE)
    assert len(read_recording(part)) > 10
    time.sleep(float(SILENCE) + 1)
    again = plugged.corexy("check", "--seconds", "1")
    said, _ = again.communicate(timeout=PATIENCE)
    assert "by_watchdog" in said or "underrun" in said  # whichever the board notices first
    assert "yes" in said  # the position is known


def test_estop_ends_with_what_to_do(plugged: Plugged, tmp_path: Path) -> None:
    done = plugged.drive(tmp_path / "run.csv", "--arm", "--loops", "20")
    _await_rows(tmp_path / "run.part.csv")
    plugged.process.send_signal(signal.SIGUSR2)
    _, complained = done.communicate(timeout=PATIENCE)
    assert done.returncode == 3
    assert "emergency stop pressed" in complained
    assert complained.strip().count("\n") == 0


def _await_rows(part: Path) -> None:
    """Until the growing recording has rows."""
    for _ in range(1000):
        if part.exists() and part.stat().st_size > 2000:
            return
        time.sleep(0.05)
    raise AssertionError(f"{part} did not grow")
