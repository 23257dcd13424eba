"""Running the command as an outsider does: in an empty folder, by its words alone.

A process for each call would cost more than most commands do.  So each command runs in one of its
own at least once (`corexy_process`), and its other cases in the test's (`corexy`).
"""

from __future__ import annotations

import io
import signal
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from corexy_fmi.cli import SIGNALS, main
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import command
from corexy_fmi.recording import Recording, write_recording
from corexy_fmi.rectangle import Rectangle

HANDLED = [getattr(signal, name) for name in SIGNALS if hasattr(signal, name)]


@pytest.fixture
def corexy(tmp_path, monkeypatch):
    """Runs the command with the given words in an empty folder, in this process.

    What it would end as a traceback is an exception here; warnings are errors here as there.
    """
    monkeypatch.chdir(tmp_path)
    before = {number: signal.getsignal(number) for number in HANDLED}

    def run(*words: object) -> subprocess.CompletedProcess[str]:
        monkeypatch.setattr(sys, "argv", ["corexy", *map(str, words)])
        said, complained = io.StringIO(), io.StringIO()
        with redirect_stdout(said), redirect_stderr(complained), pytest.raises(SystemExit) as left:
            main()
        return subprocess.CompletedProcess(
            words, left.value.code, said.getvalue(), complained.getvalue()
        )

    yield run
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def corexy_process(tmp_path):
    """Runs ``python -m corexy_fmi`` with the given words in an empty folder."""

    def run(*words: object, timeout: float = 120) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-W", "error", "-m", "corexy_fmi", *map(str, words)],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=timeout,
        )

    return run


@pytest.fixture(scope="session")
def measured(tmp_path_factory) -> Path:
    """A recording with inputs and measurements: yin2018 over a small rectangle, with some noise."""
    import numpy as np

    from corexy_fmi.simulate import simulate

    shape, machine = Rectangle(0.02, 0.015, 0.039, 2), load_machine("yin2018")
    run = simulate(machine, command(shape.motion, machine.parameters["pulley_radius"]))
    noise = np.random.default_rng(1)
    channels = {name: run[name] for name in ("phi1", "phi2")}
    channels |= {name: run[name] + 2e-5 * noise.normal(size=len(run)) for name in ("x", "y")}
    path = tmp_path_factory.mktemp("data") / "measured.csv"
    write_recording(Recording(path.name, run.time, channels), path)
    return path
