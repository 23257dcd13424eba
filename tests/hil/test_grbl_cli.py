"""`corexy hil ... --dialect grbl` on the stand-in in real time: exactness and words, not speed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from corexy_fmi.recording import read_recording
from tests.hil.emulator import ROOT

SMALL = ("--width", "0.008", "--height", "0.006", "--speed", "0.039")
PATIENCE = 60
ENVIRONMENT = {**os.environ, "PYTHONPATH": f"{ROOT / 'src'}{os.pathsep}{ROOT}"}


@dataclass
class Plugged:
    """A serial port with the stand-in behind it."""

    link: Path
    process: subprocess.Popen[str]
    told: dict[str, object] = field(default_factory=dict)

    def corexy(self, *words: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-m", "corexy_fmi", "hil", *words, "--port", str(self.link)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT, env=ENVIRONMENT,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # shells may ignore it
        )  # fmt: skip

    def done(self, *words: str) -> subprocess.CompletedProcess[str]:
        process = self.corexy(*words)
        said, complained = process.communicate(timeout=PATIENCE)
        return subprocess.CompletedProcess(words, process.returncode, said, complained)

    def rectangle(self, out: Path, *words: str) -> tuple[str, ...]:
        return ("rectangle", "--dialect", "grbl", *SMALL, "--out", str(out), *words)

    def end(self) -> dict[str, object]:
        """What the stand-in tells at its end."""
        if not self.told:
            self.process.terminate()
            self.told = json.loads(self.process.communicate(timeout=PATIENCE)[0])
        return self.told


@pytest.fixture
def plugged(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Plugged]:
    link = tmp_path / "port"
    with subprocess.Popen(
        [sys.executable, "-m", "tests.hil.grbl_pty", str(link), *getattr(request, "param", ())],
        stdout=subprocess.PIPE, text=True, cwd=ROOT, env=ENVIRONMENT,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        made = Plugged(link, process)
        yield made
        made.end()


@pytest.mark.parametrize("plugged", [("--family", "grblhal")], indirect=True)
def test_rectangle_is_driven_and_recorded(plugged: Plugged, tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    done = plugged.done(*plugged.rectangle(out, "--centred", "--arm"))
    assert done.returncode == 0, done.stderr
    assert "complete: every line taken" in done.stdout
    made = read_recording(out)
    assert made.metadata["run"] == "complete"
    assert made.metadata["clock"] == "free"
    assert made.measured == ()
    side = (tmp_path / "run.commanded.csv").read_text().splitlines()
    assert "not measured" in side[0]
    assert side[1] == "sent,heard,state,x_commanded,y_commanded"
    assert len(side) > 5
    told = plugged.end()
    assert told["overflowed"] == 0
    corner = round(-4 * 101.859), round(-3 * 101.859)  # x, y [steps] of the lower left
    assert told["counts"] == [sum(corner), corner[0] - corner[1]]


@pytest.mark.parametrize("plugged", [("--set", "100=80")], indirect=True)
def test_refused_in_one_line(plugged: Plugged, tmp_path: Path) -> None:
    done = plugged.done(*plugged.rectangle(tmp_path / "run.csv", "--centred", "--arm"))
    assert done.returncode == 2
    assert done.stderr.startswith("controller: $100=80 steps/mm, expected 101.859")
    assert done.stderr.count("\n") == 1
    assert plugged.end()["emitted"] == [0, 0]


def _await_rows(out: Path) -> None:
    """Until the motion is under way."""
    side = out.with_name(f"{out.stem}.commanded.csv")
    for _ in range(600):
        if side.exists() and side.read_text().count("Run") > 6:
            return
        time.sleep(0.05)
    raise AssertionError(f"{side} did not grow")


@pytest.mark.parametrize(
    ("blow", "words"), [(signal.SIGINT, "interrupted"), (signal.SIGUSR1, "link lost")]
)
def test_what_ends_a_run(
    plugged: Plugged, blow: signal.Signals, words: str, tmp_path: Path
) -> None:
    out = tmp_path / "run.csv"
    run = plugged.corexy(*plugged.rectangle(out, "--centred", "--arm", "--loops", "20"))
    _await_rows(out)
    (run if blow is signal.SIGINT else plugged.process).send_signal(blow)
    said, complained = run.communicate(timeout=PATIENCE)
    assert run.returncode == 3, complained
    assert words in complained
    assert complained.strip().count("\n") == 0
    assert "the carriage is at x =" in said
    made = read_recording(out)
    assert words in made.metadata["run"]
    assert 0 < made.time[-1] < 10
