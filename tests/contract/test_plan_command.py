"""``corexy plan`` as an outsider would run it."""

import json

import pytest

from corexy_fmi.recording import read_recording

FEW = """[machine]
name = "lines"
topology = "corexy"
drive = "stepper"
fidelity = "kinematic"
"""


@pytest.fixture
def lines(tmp_path):
    """A machine with the few effects of the kinematic model."""
    (tmp_path / "lines.toml").write_text(FEW)
    return ("--machine", "lines.toml", "--noise", "1e-5")


@pytest.mark.long
def test_plan_tells_sizes_and_writes_programs(corexy_process, tmp_path, lines):
    done = corexy_process("plan", *lines, "--rate", "200", "--out", "programs")
    assert (done.returncode, done.stderr.strip()) == (0, "")
    assert "axis_skew" in done.stdout
    assert "sensor_lag at sensor" in done.stdout  # beside a delay its only near twin
    files = sorted((tmp_path / "programs").glob("*.csv"))
    assert len(files) == 10
    for path in files:
        order = read_recording(path)
        assert set(order.channels) == {"phi1", "phi2"}
        assert order.time[-1] <= 10.0


def test_plan_as_json(corexy, lines):
    done = corexy("plan", *lines, "--rate", "200", "--json")
    assert (done.returncode, done.stderr.strip()) == (0, "")
    document = json.loads(done.stdout)
    assert document["noise_std"] == 1e-5
    sizes = {row["name"]: row["size"] for row in document["nameable"]}
    assert 0 < abs(sizes["axis_skew"]) < 1e-3


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--noise", "0"), "--noise"),
        (("--noise", "-1"), "--noise"),
        (("--noise", "much"), "--noise"),
        (("--noise", "1e-5", "--speed", "0"), "speed: found 0.0"),
        (("--noise", "1e-5", "--acceleration", "-2"), "acceleration: found -2.0"),
        (("--noise", "1e-5", "--rate", "0"), "--rate: found 0.0"),
        (("--noise", "1e-5", "--machine", "nowhere.toml"), "nowhere.toml"),
    ],
)
def test_bad_words_are_told_in_one_line(corexy, words, told):
    done = corexy("plan", *(() if "--machine" in words else ("--machine", "yin2018")), *words)
    assert done.returncode == 2
    assert told in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
