"""Where commands write: what they read stays, and a place that will not do is one line."""

import pytest

from corexy_fmi.machine import load_machine, save_machine

SMALL = ("--width", "0.02", "--height", "0.015", "--speed", "0.039", "--plant", "model")
ROWS = "time,phi1,phi2,x\n0,0,0,0\n0.1,0.1,0,0\n"
NAMES = ("run.csv", "next_experiment.csv", "printer.cfg", "raw.csv")
OWN = {
    "a recording": ("diagnose", "run.csv", "next_experiment.csv", "--out", "."),
    "what judges": ("diagnose", "run.csv", "--holdout", "next_experiment.csv", "--out", "."),
    "a machine": ("diagnose", "run.csv", "--machine", "machine.toml", "--out", "."),
    "a folder's machine": ("diagnose", "run.csv", "--machine", ".", "--out", "."),
    "a link": ("simulate", "link.csv", "--out", "run.csv"),
    "inputs": ("simulate", "run.csv", "--out", "./run.csv"),
    "a table": ("import", "csv", "run.csv", "--out", "run.csv"),
    "a log": ("import", "csv", "--commands", "raw.csv", "--measured", "run.csv", "--out",
              "run.csv"),
    "raw samples": ("import", "resonance", "raw.csv", "--axis", "x", "--at", "0,0", "--out",
                    "raw.csv"),
    "a path": ("pulses", "run.csv", "--out", "run.csv"),
    "a configuration": ("machine", "new", "--from", "printer.cfg", "--out", "printer.cfg"),
    "the machine of a run": ("rectangle", *SMALL, "--machine", "machine.toml", "--out",
                             "machine.toml"),
    "a figure's machine": ("rectangle", *SMALL, "--machine", "machine.toml", "--out", "o.csv",
                           "--plot", "machine.toml"),
    "one file twice": ("rectangle", *SMALL, "--out", "a.png", "--plot", "a.png"),
    "a board's motion": ("hil", "run", "run.csv", "--port", "none", "--out", "run.csv"),
    "a board's machine": ("hil", "diagnose", "--port", "none", "--tracker", "none", "--machine",
                          "machine.toml", "--out", "."),
}  # fmt: skip


@pytest.mark.parametrize("words", OWN.values(), ids=OWN)
def test_what_a_command_reads_is_not_written(corexy, tmp_path, words):
    for name in NAMES:
        (tmp_path / name).write_text(ROWS)
    save_machine(load_machine("yin2018"), tmp_path / "machine.toml")
    (tmp_path / "link.csv").symlink_to("run.csv")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    done = corexy(*words)
    assert (done.returncode, done.stdout) == (2, "")
    assert "place" in done.stderr.partition("expected ")[2]
    assert done.stderr.count("\n") == 1
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


NAMELESS = {
    "build": (), "demo": (), "rectangle": SMALL, "simulate": ("run.csv",),
    "diagnose": ("run.csv",), "fleet": (".",), "pulses": ("run.csv",), "import csv": ("run.csv",),
    "import mat": ("run.mat",), "import klipper": ("raw.csv",), "import resonance": ("raw.csv",),
    "import motan": ("raw.json",), "machine new": (), "reproduce fig3": (), "sweep": SMALL[:6],
    "plan": ("--machine", "yin2018", "--noise", "1e-5"), "hil run": ("run.csv", "--port", "none"),
    "hil rectangle": (*SMALL[:6], "--port", "none"),
    "hil diagnose": ("--port", "none", "--tracker", "none"),
}  # fmt: skip


@pytest.mark.parametrize(("name", "words"), NAMELESS.items(), ids=NAMELESS)
def test_a_place_without_a_name_is_none(corexy, tmp_path, name, words):
    done = corexy(*name.split(), *words, "--out", "")
    assert (done.returncode, done.stdout) == (2, "")
    assert "'--out': found no name, expected a place to write" in done.stderr
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
