"""Bad input: status 2, one line on stderr that says what and where, nothing written."""

import os
import signal
import subprocess
import sys
import time

import pytest

from corexy_fmi.commands.diagnose import expand_holdouts

SMALL = ("--width", "0.02", "--height", "0.015", "--speed", "0.039")
GOOD = "time,phi1,phi2,x\n0,0,0,0\n0.1,0.1,0,0\n"
OWN = """
from corexy_fmi.effects.api import AXES, Effect, Law, Parameter
def drag(velocity, size):
    return {"damping": size * velocity}
EFFECT = Effect(name="own", summary="a drag", locations=AXES,
    parameters=(Parameter("size", "N s/m", "its size", 0.0, 0.0, 9.0, (1.0,), size=True),),
    laws=(Law("guide", drag),), equation="", citation="", remedy="", check="", looks_like="",
    state="speed")
"""


def rows(name, cell):
    """A recording in which motor 1 turns, with one measured channel."""
    lines = [f"{n / 1e3},{n / 1e2},0,{cell.format(n=n)}" for n in range(200)]
    return "\n".join([f"time,phi1,phi2,{name}", *lines]) + "\n"


FILES = {
    "good.csv": GOOD,
    "word.csv": "time,phi1,phi2,x\n0,0,0,0\n0.1,zero,0,0\n",
    "back.csv": "time,phi1,phi2,x\n0,0,0,0\n0,0,0,0\n",
    "blind.csv": "time,phi1,phi2\n0,0,0\n0.1,0,0\n",
    "volts.csv": "time,V1,V2,x\n0,0,0,0\n0.1,0,0,0\n",
    "far.csv": "time,phi1,phi2\n0,0,0\n0.1,1e308,0\n0.2,0,0\n",
    "gap.csv": GOOD + "1e6,0.1,0,0\n1000000.1,0.2,0,0\n",
    "gains.csv": "# controller: pd kp=1e400 kd=0\n" + GOOD,
    "dead.csv": rows("x", "0"),
    "encoders.csv": rows("phi1_meas", "{n}"),
    "nested.toml": "a = " + "[" * 3000,
    "digits.toml": "[parameters]\ncarriage_mass = " + "1" * 400 + "\n",
    "empty.mat": "",
    "empty.csv": "",
    "typo.toml": "[parameters]\ncarriage_mas = 0.1\n",
    "open.toml": "[machine]\ndrive = 'dc'\n",
    "three.toml": "effects = 3\n",
    "one.toml": "[effects]\nname = 'backlash'\n",
    "effect.py": "EFFECT = 3\n",
    "empty.py": "",
    "leaves.py": "import sys\nsys.exit(3)\n",
    "broken.py": "import math\nEFFECT = math.sine(1.0)\n",
    "typo.py": OWN.replace("velocity", "velocty"),
    "port.py": OWN.replace('"guide"', '"gide"'),
    "place.py": OWN.replace("locations=AXES", 'locations=("z",)'),
    "sizeless.py": OWN.replace(", size=True", ""),
    "bounds.py": OWN.replace("0.0, 0.0, 9.0", "0.0, 9.0, 0.0"),
    "spaces.py": OWN.replace('name="own"', 'name="my own!"'),
    "attribute.py": OWN.replace("size * velocity", "size * velocity.speed"),
    "raw.csv": "#time,accel_x,accel_y,accel_z\n0,0,0,0\n1,1,1,1\n",
}
KLIPPER = ("import", "klipper", "raw.csv", "--speed", "0.1", "--accel", "1", "--out", "o.csv")
RECTANGLE = ("rectangle", *SMALL, "--plant", "model", "--out", "o.csv")
SWEEP = ("sweep", *SMALL, "--sets", "8", "--out", "o")
BAD = {
    "unknown command": (("diagnos",), "diagnos"),
    "unknown option": (("effects", "--jsn"), "--jsn"),
    "missing option": (("rectangle", "--width", "1"), "--height"),
    "option no number": (("rectangle", "--width", "wide"), "--width"),
    "unknown plant": ((*RECTANGLE, "--plant", "fma"), "--plant"),
    "absent recording": (("simulate", "none.csv", "--out", "o.csv"), "none.csv: No such file"),
    "cell no number": (
        ("simulate", "word.csv", "--out", "o.csv"),
        "word.csv, line 3, column phi1: found 'zero', expected a finite number",
    ),
    "a number beyond all": (
        ("simulate", "far.csv", "--out", "o.csv"),
        "far.csv, line 3, column phi1: found '1e308', expected a number within 1e+12",
    ),
    "two logs in one": (
        ("diagnose", "gap.csv", "--out", "o"),
        "gap.csv, line 4, column time: 1000000.0 after 0.1, expected one run without a gap",
    ),
    "endless loop": (
        ("diagnose", "gains.csv", "--machine", "yin2018_dc", "--out", "o"),
        "metadata controller: found 'pd kp=1e400 kd=0'",
    ),
    "dead sensor": (
        ("diagnose", "dead.csv", "--out", "o"),
        "(channel x never changes although the stage is driven)",
    ),
    "encoders of a stepper": (
        ("diagnose", "encoders.csv", "--out", "o"),
        "(encoders are fitted with drive dc only)",
    ),
    "no machine's name": (
        ("simulate", "good.csv", "--machine", "", "--out", "o.csv"),
        "machine: found no name",
    ),
    "machine of brackets": (
        ("simulate", "good.csv", "--machine", "nested.toml", "--out", "o.csv"),
        "nested.toml: not TOML",
    ),
    "machine of digits": (
        ("simulate", "good.csv", "--machine", "digits.toml", "--out", "o.csv"),
        "carriage_mass: found 1111",
    ),
    "file without a name": (("simulate", "good.csv", "--out", "."), "expected a file"),
    "crawling": ((*RECTANGLE, "--speed", "1e-9"), "expected at most 1e+08 rows"),
    "noise without end": (
        ("plan", "--machine", "light_bench", "--noise", "inf"),
        "--noise: found inf",
    ),
    "empty matrix": (
        ("import", "mat", "empty.mat", "--map", "time=t", "--out", "o.csv"),
        "empty.mat: ",
    ),
    "empty table": (
        ("import", "csv", "empty.csv", "--map", "time=t", "--out", "o.csv"),
        "empty.csv: no header line",
    ),
    "loop of a table": (
        ("import", "csv", "good.csv", "--about", "controller: foo", "--out", "o.csv"),
        "o.csv, metadata controller: found 'foo'",
    ),
    "two loops of a table": (
        ("import", "csv", "good.csv", "--about", "a: 1", "--about", "a : 2", "--out", "o.csv"),
        "about: 'a' twice, expected once",
    ),
    "clock of a table": (
        ("import", "csv", "good.csv", "--about", "clock: wob", "--out", "o.csv"),
        "o.csv, metadata clock: found 'wob'",
    ),
    "start that is none": ((*KLIPPER, "--move", "0,0:0.01,0", "--start-offset", "nan"), "o.csv, "),
    "time": (("diagnose", "back.csv", "--out", "o"), "back.csv, line 3, column time"),
    "nothing measured": (("diagnose", "blind.csv", "--out", "o"), "no measured samples, expected"),
    "same file twice": (("diagnose", "good.csv", "good.csv", "--out", "o"), "given twice"),
    "judge is the judged": (
        ("diagnose", "good.csv", "--out", "o", "--holdout", "good.csv"),
        "given twice",
    ),
    "bad holdout": (
        ("diagnose", "good.csv", "--holdout", "blind.csv", "word.csv", "--out", "o"),
        "blind.csv: no measured",
    ),
    "drive": (
        ("diagnose", "volts.csv", "--machine", "gt2_printer", "--out", "o"),
        "no columns phi1, phi2",
    ),
    "pulses of nothing": (("pulses", "none.gcode", "--out", "o.csv"), "none.gcode: No such file"),
    "pulses for dc": (
        (*RECTANGLE, "--microsteps", "2", "--machine", "yin2018_dc"),
        "drive 'dc' takes no pulses, expected a stepper",
    ),
    "unknown machine": ((*RECTANGLE, "--machine", "yin2817"), "nearest known: yin2018"),
    "machine's key": (
        (*RECTANGLE, "--machine", "typo.toml"),
        "unknown parameter 'carriage_mas'; nearest known: carriage_mass",
    ),
    "set that is none": (
        ("reproduce", "fig4", "--machine", "voron2_250"),
        "found 'voron2_250', expected one of",
    ),
    "sets below none": (("reproduce", "claims", "--sets", "-1"), "sets: found -1, expected"),
    "one loop": (("reproduce", "fig3", "--loops", "1"), "loops: found 1, expected at least 2"),
    "dc without loop": ((*RECTANGLE, "--machine", "open.toml"), "no [controller], expected"),
    "off the stage": ((*RECTANGLE, "--width", "0.19"), "leaves the stage"),
    "negative size": ((*RECTANGLE, "--width", "-1"), "width: found -1.0, expected a positive"),
    "size of a hair's breadth": (
        (*RECTANGLE, "--width", "1e-300"),
        "width: found 1e-300, expected at least 1e-06 m",
    ),
    "no speed": ((*RECTANGLE, "--speed", "0"), "speed: found 0.0, expected a positive"),
    "no acceleration": ((*RECTANGLE, "--accel", "0"), "acceleration: found 0.0, expected"),
    "no loops": ((*RECTANGLE, "--loops", "0"), "loops: found 0, expected at least 1"),
    "loops without end": ((*RECTANGLE, "--loops", "1000000000"), "loops: found 1000000000 of 1."),
    "loops of no time": (
        (*RECTANGLE, "--loops", "90000000", "--speed", "1e9"),
        "expected at most 1e+08 rows",
    ),
    "figure's ending": ((*RECTANGLE, "--plot", "run.doc"), "unknown ending '.doc', expected .png"),
    "place of a file": (
        ("rectangle", *SMALL, "--plant", "model", "--out", "good.csv/o.csv"),
        "cannot be written",
    ),
    "place of a folder": (("diagnose", "good.csv", "--out", "good.csv"), "expected a folder"),
    "unknown effect": (("effects", "backlsh"), "nearest known: backlash"),
    "own effect": (
        ("diagnose", "good.csv", "--effects", "effect.py", "--out", "o"),
        "EFFECT: found 3, expected an instance of Effect",
    ),
    "own effect broken": (
        ("diagnose", "good.csv", "--effects", "broken.py", "--out", "o"),
        "broken.py: line 2: cannot be loaded as an effect: AttributeError",
    ),
    "own effect that leaves": (
        ("diagnose", "good.csv", "--effects", "leaves.py", "--out", "o"),
        "leaves.py: line 2: cannot be loaded as an effect: SystemExit: 3, expected",
    ),
    "own effect of none": (
        ("diagnose", "good.csv", "--effects", "empty.py", "--out", "o"),
        "empty.py: EFFECT is missing, expected an instance of Effect",
    ),
    "effects that are none": (
        (*RECTANGLE, "--machine", "three.toml"),
        "three.toml: effects: found 3, expected [[effects]]",
    ),
    "effects of one table": (
        (*RECTANGLE, "--machine", "one.toml"),
        "one.toml: effects: found one table, expected [[effects]]",
    ),
    "own effect's word": (
        ("diagnose", "good.csv", "--effects", "typo.py", "--out", "o"),
        "own: drag reads velocty",
    ),
    "own effect's port": (
        ("diagnose", "good.csv", "--effects", "port.py", "--out", "o"),
        "own: drag: unknown port 'gide'",
    ),
    "own effect's places": (
        ("simulate", "good.csv", "--effects", "place.py", "--out", "o.csv"),
        "place.py: locations: found ('z',)",
    ),
    "own effect without a size": (
        ("simulate", "good.csv", "--effects", "sizeless.py", "--out", "o.csv"),
        "sizeless.py: no parameter with size=True",
    ),
    "own effect's bounds": (
        ("build", "--effects", "bounds.py", "--out", "o"),
        "bounds.py: parameter size: found bounds 9 to 0",
    ),
    "own effect's name": (
        ("simulate", "good.csv", "--effects", "spaces.py", "--out", "o.csv"),
        "spaces.py: name 'my own!'",
    ),
    "own effect's law": (
        ("diagnose", "good.csv", "--effects", "attribute.py", "--out", "o"),
        "own: drag cannot be traced: AttributeError",
    ),
    "own effect absent": (
        ("diagnose", "good.csv", "--effects", "none.py", "--out", "o"),
        "cannot be loaded",
    ),
    "no jobs": (("diagnose", "good.csv", "--jobs", "0", "--out", "o"), "--jobs"),
    "flavour": (("build", "--flavour", "wasm"), "--flavour"),
    "format": (("import", "gcode", "raw.csv"), "gcode"),
    "move": ((*KLIPPER, "--move", "0,0"), "move: found '0,0', expected X0,Y0:X1,Y1"),
    "move's ends": ((*KLIPPER, "--move", "0,0:a,0"), "move: found 'a,0', expected two numbers"),
    "move nowhere": ((*KLIPPER, "--move", "0,0:0,0"), "expected two different ends"),
    "move off the stage": ((*KLIPPER, "--move", "0,0:1,0"), "leaves the stage"),
    "sweep's key": (
        (*SWEEP, "--vary", "belt_axial_stifness=500:900"),
        "nearest known: belt_axial_stiffness",
    ),
    "sweep's bounds": ((*SWEEP, "--vary", "backlash.motor1.gap=0:3"), "expected a value from 0"),
    "sweep of nothing": (SWEEP, "vary: found none, expected --vary"),
    "axes": ((*KLIPPER, "--move", "0,0:0.01,0", "--axes", "z,z"), "axes: found 'z,z'"),
}


@pytest.mark.parametrize(("words", "said"), BAD.values(), ids=BAD)
def test_bad_input(corexy, tmp_path, words, said):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    done = corexy(*words)
    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert done.stdout == ""
    assert {path.name for path in tmp_path.iterdir()} == set(FILES)


@pytest.mark.parametrize("case", ["missing option", "cell no number", "pulses of nothing"])
def test_bad_input_of_a_process(corexy_process, tmp_path, case):
    """The process itself: its status, its two streams, its folder."""
    test_bad_input(corexy_process, tmp_path, *BAD[case])


def test_one_file_by_two_names_judges_nothing(corexy, tmp_path):
    (tmp_path / "good.csv").write_text(GOOD, encoding="utf-8")
    os.link(tmp_path / "good.csv", tmp_path / "other.csv")
    done = corexy("diagnose", "good.csv", "--holdout", "other.csv", "--out", "o")
    assert done.returncode == 2
    assert done.stderr == "other.csv: given twice, expected each recording once\n"


def test_holdout_takes_every_file_up_to_the_next_option():
    words = ["a.csv", "--holdout", "h1.csv", "h2.csv", "--jobs", "2", "--holdout=h3.csv", "h4.csv"]
    assert expand_holdouts(words) == [
        "a.csv", "--holdout", "h1.csv", "--holdout", "h2.csv", "--jobs", "2",
        "--holdout=h3.csv", "--holdout", "h4.csv",
    ]  # fmt: skip


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize(("number", "status"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_an_interrupt_ends_cleanly(tmp_path, number, status):
    words = ("rectangle", *SMALL, "--loops", "8000", "--plant", "model", "--out", "o.csv")
    code = "from corexy_fmi.cli import main; print('imported', flush=True); main()"
    process = subprocess.Popen(
        [sys.executable, "-c", code, *words],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(getattr(signal, number), signal.SIG_DFL),  # or ignored
    )  # fmt: skip
    try:
        assert process.stdout.readline() == "imported\n"
        time.sleep(1.5)
        process.send_signal(getattr(signal, number))
        _, said = process.communicate(timeout=60)
    finally:
        process.kill()  # one that heard nothing would go on for hours
    assert process.returncode == status
    assert "Traceback" not in said
    assert list(tmp_path.iterdir()) == []
