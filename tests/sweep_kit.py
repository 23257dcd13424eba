"""What the tests of sweeps share: a small one, done here or as a user does it."""

import os
import signal
import subprocess
import sys
import time

from corexy_fmi.machine import load_machine
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.sweep.folder import Folder
from corexy_fmi.sweep.plan import Plan
from corexy_fmi.sweep.run import sweep
from corexy_fmi.sweep.vary import read_ranges
from corexy_fmi.sweep.workers import workers

SHAPE = Rectangle(0.012, 0.010, 0.05)
VARY = ("belt_axial_stiffness=500:2000:log", "backlash.motor1.gap=0:0.02")
WORDS = ("--width", "0.012", "--height", "0.01", "--speed", "0.05")


def plan(sets=200, chunk=64, vary=VARY, machine="yin2018", shape=SHAPE, **more):
    ranges, chosen = read_ranges(vary, (), load_machine(machine))
    return Plan(chosen, shape, ranges, sets, chunk=chunk, **more)


def run(what, path, jobs=1, report=lambda sets: None):
    """Do or go on with a sweep; the numbers of the chunks that were found done."""
    machine = what.machine
    about = {"machine": machine.name, "surrogate": machine.surrogate}
    folder = Folder(path, what.document(), about)
    with workers(jobs) as (executor, ahead):
        done = folder.open()
        sweep(what, folder, done, executor, ahead, report)
    return done


def contents(path):
    """Every chunk's bytes by name."""
    return {file.name: file.read_bytes() for file in (path / "sets").iterdir()}


def start(folder, jobs, sets):
    """A sweep as a user starts it, with chunks as in `plan`, in a group of its own."""
    words = ["sweep", *WORDS, "--sets", sets, "--chunk", 64, "--jobs", jobs, "--out", "o"]
    words += [word for text in VARY for word in ("--vary", text)]
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "corexy_fmi", *map(str, words)],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip


def wait_for_chunks(folder, count, process):
    """Until the ledger has so many lines."""
    ledger, end = folder / "o" / "chunks.jsonl", time.monotonic() + 60
    while not ledger.exists() or ledger.read_text().count("\n") < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end
        time.sleep(0.01)


def group_is_gone(group):
    """Whether no process of a group is left, in ten seconds."""
    for _ in range(200):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False
