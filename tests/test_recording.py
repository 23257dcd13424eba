"""Recordings: numbers that survive, blanks that stay blank, mistakes named by line and column."""

from time import perf_counter

import numpy as np
import pytest
from fmpy.util import read_csv, write_csv

from corexy_fmi.errors import InputError
from corexy_fmi.machine import Controller, load_machine
from corexy_fmi.recording import (
    Recording,
    check_drive,
    controller,
    inputs,
    is_dc,
    read_recording,
    write_recording,
)
from corexy_fmi.recording import table as table_module


@pytest.fixture
def csv(tmp_path):
    """Writes text or bytes to a file and gives its path."""

    def write(content):
        path = tmp_path / "run.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


def random_recording(rows=500, seed=3):
    generator = np.random.default_rng(seed)
    scale = 10.0 ** generator.integers(-12, 6, size=rows)
    channels = {name: generator.normal(size=rows) * scale for name in ("phi1", "phi2", "x", "odd")}
    channels["x"][1::3] = np.nan
    time = np.cumsum(generator.uniform(1e-6, 1e-2, size=rows))
    return Recording("run.csv", time, channels, {"machine": "m", "note": "a: b, c"})


def same(first, second):
    assert np.array_equal(first.time, second.time)
    assert list(first.channels) == list(second.channels)
    for name in first.channels:
        assert np.array_equal(first[name], second[name], equal_nan=True)


def test_written_numbers_read_back_to_the_same_bits(tmp_path):
    recording = random_recording()
    write_recording(recording, tmp_path / "run.csv")
    again = read_recording(tmp_path / "run.csv")
    same(recording, again)
    assert again.metadata == recording.metadata
    assert again.name == "run.csv"


def test_small_blocks_give_the_same_table(tmp_path, monkeypatch):
    recording = random_recording()
    write_recording(recording, tmp_path / "run.csv")
    monkeypatch.setattr(table_module, "BLOCK", 64)
    same(recording, read_recording(tmp_path / "run.csv"))


def test_what_other_tools_write_is_read(csv):
    windows = b'\xef\xbb\xbf"time","phi1", phi2 ,x\r\n 0 ,1,2, \r\n1,+1.5E0,.5,\r\n\r\n'
    recording = read_recording(csv(windows))
    assert recording["phi1"].tolist() == [1.0, 1.5]
    assert np.isnan(recording["x"]).all()
    assert recording.measured == ()


def test_a_result_of_fmpy_is_a_recording_and_back(tmp_path):
    result = np.array(
        [(0.0, 0.1, 0.2, 1e-3), (0.1, 1 / 3, 0.5, 2e-3)],
        dtype=[(name, float) for name in ("time", "phi1", "phi2", "x")],
    )
    write_csv(tmp_path / "fmpy.csv", result)
    recording = read_recording(tmp_path / "fmpy.csv")
    assert recording["phi1"].tolist() == result["phi1"].tolist()
    write_recording(recording, tmp_path / "plain.csv", plain=True)
    back = read_csv(tmp_path / "plain.csv")
    assert back.dtype.names == result.dtype.names
    assert back["phi1"].tolist() == result["phi1"].tolist()


def test_outputs_alone_can_be_read_where_no_inputs_are_needed(csv):
    assert "x" in read_recording(csv("time,x\n0,1\n1,2\n"), needs_inputs=False)


GOOD = "time,phi1,phi2,x\n"
BAD = {
    "empty": ("", "no header line"),
    "metadata alone": ("# a: b\n", "no header line"),
    "metadata twice": ("# a: b\n# a: c\n", "line 2: metadata 'a' twice"),
    "binary": (b"\xff\xfe\x00\n", "line 1: not UTF-8"),
    "no time first": ("t,phi1,phi2\n0,1,2\n", "line 1, column 1: found 't'"),
    "semicolons": ("time;phi1;phi2\n0;1;2\n", "separated by commas"),
    "column twice": ("time,phi1,phi2,phi1\n", "line 1, column 4: 'phi1' appears twice"),
    "blank name": ("time,phi1,,phi2\n", "line 1, column 3: blank name"),
    "no inputs": ("time,x\n0,1\n1,2\n", "line 1: no input columns, expected phi1 and phi2"),
    "half the inputs": ("time,phi1,V2\n0,1,1\n1,2,1\n", "line 1: only 'phi1'"),
    "mistyped inputs": ("time,phi_1,phi_2\n0,1,1\n1,2,1\n", "'phi_1' is near 'phi1'"),
    "no rows": (GOOD, "line 2: 0 rows of numbers"),
    "one row": (GOOD + "0,1,2,3\n", "1 rows of numbers, expected at least 2"),
    "word": (GOOD + "0,1,2,3\n1,1,zwei,3\n", "line 3, column phi2: found 'zwei'"),
    "nan": (GOOD + "0,1,2,3\n1,1,2,nan\n", "line 3, column x: found 'nan'"),
    "inf": (GOOD + "0,1,2,3\n1,1,2,-inf\n", "line 3, column x: found '-inf'"),
    "overflow": (GOOD + "0,1,2,3\n1,1,2,1e999\n", "line 3, column x: found '1e999'"),
    "underscore": (GOOD + "0,1,2,3\n1,1,2,1_0\n", "line 3, column x: found '1_0'"),
    "two numbers in a cell": (GOOD + "0,1,2,3\n1,1,2,1 0\n", "line 3, column x: found '1 0'"),
    "lone sign": (GOOD + "0,1,2,3\n1,1,2,-\n", "line 3, column x: found '-'"),
    "short row": (GOOD + "0,1,2,3\n1,1,2\n", "line 3: 3 cells, expected 4"),
    "long row": (GOOD + "0,1,2,3\n1,1,2,3,4\n", "line 3: 5 cells, expected 4"),
    "rows that make up for each other": (GOOD + "0,1,2\n1,1,2,3,4\n", "line 2: 3 cells"),
    "blank line": (GOOD + "0,1,2,3\n\n1,1,2,3\n", "line 3: 1 cells"),
    "late comment": (GOOD + "0,1,2,3\n# c: d\n", "line 3: a # line after the header"),
    "blank time": (GOOD + "0,1,2,3\n,1,2,3\n", "line 3, column time: blank"),
    "time stands": (GOOD + "0,1,2,3\n0,1,2,3\n", "line 3, column time: 0.0 after 0.0"),
    "time runs back": ("# a: b\n" + GOOD + "0,1,2,3\n1,1,2,3\n.5,1,2,3\n", "line 5, column time"),
    "blank first input": (GOOD + "0,,2,3\n1,1,2,3\n", "line 2, column phi1: blank"),
    "clock": ("# clock: fre\n" + GOOD + "0,1,2,3\n1,1,2,3\n", "metadata clock: found 'fre'"),
    "controller": (
        "# controller: pid kp=1\n" + GOOD + "0,1,2,3\n1,1,2,3\n",
        "metadata controller: found 'pid kp=1', expected 'pd kp=20 kd=0.1'",
    ),
}


@pytest.mark.parametrize(("content", "said"), BAD.values(), ids=BAD)
def test_mistakes_are_named_by_line_and_column(csv, content, said):
    path = csv(content)
    with pytest.raises(InputError) as caught:
        read_recording(path)
    line = str(caught.value)
    assert said in line
    assert line.startswith(str(path))
    assert "expected" in line
    assert "\n" not in line


def test_a_mistake_far_down_is_found_at_its_line(csv):
    rows = [f"{i},1,2,3" for i in range(200_000)]
    rows[150_000] = "150000,1,2,x"
    with pytest.raises(InputError, match="line 150002, column x: found 'x'"):
        read_recording(csv(GOOD + "\n".join(rows)))


def test_an_hour_at_one_kilohertz_reads_within_twenty_seconds(tmp_path):
    rows = 200_000
    long = random_recording(rows)
    write_recording(long, tmp_path / "run.csv")
    ends = [perf_counter()]
    for _ in range(3):  # other work on the machine may delay one of them
        read_recording(tmp_path / "run.csv")
        ends.append(perf_counter())
    assert min(np.diff(ends)) * 3_600_000 / rows < 20.0


def test_absent_file_and_folder(tmp_path):
    for path in (tmp_path / "none.csv", tmp_path):
        with pytest.raises(InputError, match="expected a recording"):
            read_recording(path)


def recording(metadata=None, **channels):
    rows = len(next(iter(channels.values())))
    arrays = {name: np.array(values, dtype=float) for name, values in channels.items()}
    return Recording("r.csv", np.arange(rows) * 0.1, arrays, metadata or {})


def test_angles_are_linear_and_voltages_held_over_blanks():
    nan = np.nan
    given = inputs(recording(phi1=[0, nan, 2, nan], phi2=[1, 1, 1, 1], V1=[5, nan, 7, nan]))
    assert given["phi1"] == pytest.approx([0, 1, 2, 2])
    assert given["V1"].tolist() == [5, 5, 7, 7]
    assert list(given) == ["phi1", "phi2", "V1"]


def test_controller_of_the_metadata():
    loop = recording({"controller": "pd  kp = 2e1 kd=0.1"}, phi1=[0, 1], phi2=[0, 1])
    assert controller(loop) == Controller(20.0, 0.1)
    assert is_dc(loop)
    assert controller(recording(phi1=[0, 1])) is None


def test_inputs_must_fit_the_drive():
    angles, volts = recording(phi1=[0, 1], phi2=[0, 1]), recording(V1=[0, 1], V2=[0, 1])
    stepper, dc = load_machine("yin2018"), load_machine("yin2018_dc")
    for fits in ((angles, stepper), (volts, dc), (angles, dc)):
        check_drive(*fits)
    with pytest.raises(InputError, match=r"r\.csv: no columns phi1, phi2"):
        check_drive(volts, stepper)
    with pytest.raises(InputError, match=r"r\.csv: no columns V1, V2"):
        check_drive(recording(x=[0, 1]), dc)
