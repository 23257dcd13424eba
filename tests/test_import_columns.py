"""Recordings out of tables: MATLAB files and CSV, with a map of columns and their units."""

import numpy as np
import pytest
from scipy.io import savemat
from typer.testing import CliRunner

from corexy_fmi.cli import app
from corexy_fmi.errors import InputError
from corexy_fmi.recording import read_recording
from corexy_fmi.recording.columns import import_columns

TIME = np.arange(5) * 0.01


@pytest.fixture
def mat(tmp_path):
    path = tmp_path / "run.mat"
    columns = {"t": TIME[:, None], "pos": np.arange(5.0), "kp": 3.0, "note": "text"}
    savemat(path, columns | {"u": np.arange(5), "ref": 0.1 * np.arange(5.0)})
    return path


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "log.csv"
    rows = "".join(f"{10 * n},{90 * n},{n},{2 * n},\n" for n in range(5))
    path.write_text(f'# made by hand\n"t ms",m1,m2,acc,gap\n{rows}')
    return path


@pytest.mark.parametrize(
    ("entry", "channel", "last"),
    [
        ("x=pos[mm]", "x", 4e-3),
        ("x=pos", "x", 4.0),
        ("ax=pos[g]", "ax", 4 * 9.80665),
        ("phi1=pos[deg]", "phi1", 4 * np.pi / 180),
        ("phi1=pos[steps]", "phi1", 4 * np.pi / 100),
        ("phi1=pos[mm]", "phi1", 4e-3 / 0.02),
        (" V1 = u [mV] ", "V1", 4e-3),
    ],
)
def test_units_of_a_mat_file(mat, entry, channel, last):
    recording = import_columns(mat, ["time=t", entry], {"motors": "1"}, 0.02)
    assert np.allclose(recording.time, TIME)
    assert recording[channel][-1] == pytest.approx(last, rel=1e-14)
    assert recording.metadata == {"motors": "1"}


def test_a_csv_file_with_blanks_and_a_comment(table):
    entries = ["time=t ms[ms]", "phi1=m1[deg]", "phi2=m2[rev]", "ay=gap"]
    recording = import_columns(table, entries, {}, 0.005)
    assert np.allclose(recording.time, TIME)
    assert recording["phi1"][4] == pytest.approx(2 * np.pi)
    assert recording["phi2"][1] == pytest.approx(2 * np.pi)
    assert np.isnan(recording["ay"]).all()


@pytest.mark.parametrize(
    ("entries", "told"),
    [
        (["x=pos"], "no column mapped to time"),
        (["time=t", "x:pos"], "expected OURS=THEIRS"),
        (["time=t", "z=pos"], "unknown channel 'z'"),
        (["time=t", "x=pos", "x=ref"], "map: x 2 times, expected once"),
        (["time=t", "x=poss"], "no column 'poss'.*pos"),
        (["time=t", "x=pos[V]"], "unit 'V', expected one of m, mm, um"),
        (["time=t", "x=kp"], "different lengths .*x 1"),
        (["time=u[mm]"], "unit 'mm', expected one of s, ms, us"),
    ],
)
def test_mistakes_are_told_in_a_line(mat, entries, told):
    with pytest.raises(InputError, match=told):
        import_columns(mat, entries, {}, 0.005)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("# by hand\ntime,x\n0,1\n0.1,2\n0.05,3\n", "line 5, column time: 0.05 after 0.1"),
        ("time,x\n0,1\n,2\n", "line 3, column time: blank"),
        ("time,x\n", "line 2: 0 rows of numbers, expected at least 2"),
        ("time,x\n0,1\n", "line 3: 1 rows of numbers, expected at least 2"),
        ("time,x,x\n0,1,2\n1,1,2\n", "column 'x' stands 2 times in the header, expected once"),
    ],
)
def test_mistakes_of_a_table_are_told_with_their_line(tmp_path, text, told):
    path = tmp_path / "log.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        import_columns(path, [], {}, 0.005)
    assert told in str(caught.value)


def test_columns_that_nobody_takes_may_stand_twice(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,x,note,note\n0,1,2,3\n1,1,2,3\n")
    assert list(import_columns(path, [], {}, 0.005).channels) == ["x"]


@pytest.mark.parametrize("text", ["# by hand\ntime,x\n0,1\n1,2\n", "time,x\n0,1\n1,2\n"])
def test_a_mark_of_byte_order_is_no_text(tmp_path, text):
    path = tmp_path / "log.csv"
    path.write_text(text, encoding="utf-8-sig")
    assert import_columns(path, ["time=time", "x=x"], {}, 0.005)["x"].tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (np.zeros((2, 5)), "column 'm' is a matrix of 2 x 5, expected a vector"),
        (np.arange(5.0)[::-1], "row 2, column time: 3.0 after 4.0"),
    ],
)
def test_mistakes_of_a_mat_file(tmp_path, value, told):
    savemat(tmp_path / "run.mat", {"m": value, "x": np.arange(5.0)})
    with pytest.raises(InputError, match=told):
        import_columns(tmp_path / "run.mat", ["time=m", "x=x"], {}, 0.005)


def test_a_file_that_is_no_table(tmp_path):
    wrong = tmp_path / "wrong.mat"
    wrong.write_text("not a MATLAB file at all, but long enough to be looked at" * 9)
    for path in (wrong, tmp_path / "absent.mat", tmp_path / "absent.csv"):
        with pytest.raises(InputError, match=path.name):
            import_columns(path, ["time=t"], {}, 0.005)


def test_the_command_writes_a_recording(mat, tmp_path):
    out = tmp_path / "run.csv"
    words = ["import", "mat", str(mat), "--map", "time=t", "--map", "phi1=ref[mm]", "--map"]
    words += ["x=pos[um]", "--about", "motors: 1", "--about", "zero: x", "--machine", "emps"]
    done = CliRunner().invoke(app, [*words, "--out", str(out)])
    assert done.exit_code == 0, done.output
    recording = read_recording(out)
    assert recording.metadata == {"motors": "1", "zero": "x"}
    assert recording["phi1"][-1] == pytest.approx(4e-4)
