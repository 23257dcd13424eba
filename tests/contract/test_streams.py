"""Odd surroundings: streams that are closed, full or narrow, a folder that is gone, a hang-up."""

import json
import os
import signal
import subprocess
import sys
import types

import pytest

from corexy_fmi.entry import main

pytestmark = pytest.mark.skipif(os.name == "nt", reason="streams and signals of POSIX")
COREXY = f"{sys.executable} -W error -m corexy_fmi"


def shell(words, folder, **environment):
    return subprocess.run(
        ["sh", "-c", f"{COREXY} {words}"], cwd=folder, env={**os.environ, **environment},
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip


@pytest.mark.parametrize("closed", [">&-", ">&- 2>&-", "<&- >&- 2>&-"])
@pytest.mark.parametrize("words", ["effects", "effects --json", "effects backlash"])
def test_a_closed_stream_is_nothing(tmp_path, words, closed):
    done = shell(f"{words} {closed}", tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="a device of Linux")
@pytest.mark.parametrize("words", ["effects", "effects backlash --json", "--help"])
def test_a_full_stdout_is_one_line(tmp_path, words):
    done = shell(f"{words} > /dev/full", tmp_path)
    assert done.returncode == 1
    assert "No space left on device, expected room" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_json_is_json_in_any_encoding(tmp_path, encoding):
    done = subprocess.run(
        [*COREXY.split(), "effects", "--json"],
        env={**os.environ, "PYTHONIOENCODING": encoding}, capture_output=True, timeout=60,
    )  # fmt: skip
    told = json.loads(done.stdout.decode(encoding))
    assert (done.returncode, done.stderr) == (0, b"")
    assert any("ć" in effect["citation"] for effect in told)


def test_letters_that_an_encoding_lacks_are_told(tmp_path):
    done = shell("simulate größe.csv --out o.csv", tmp_path, PYTHONIOENCODING="ascii")
    assert done.returncode == 2
    assert done.stderr.startswith(r"gr\xf6\xdfe.csv: No such file")
    assert shell("effects", tmp_path, PYTHONIOENCODING="ascii").returncode == 0


def test_no_bar_without_a_terminal(corexy, tmp_path):
    (tmp_path / "short.csv").write_text("time,phi1,phi2,x\n0,0,0,0\n0.1,0,0,0\n")
    done = corexy("diagnose", "short.csv", "--out", "o")
    assert done.returncode == 2
    assert done.stderr.startswith("short.csv")
    assert done.stderr.count("\n") == 1


def test_a_folder_that_is_gone_is_one_line(tmp_path):
    (tmp_path / "gone").mkdir()
    words = "rectangle --width 0.02 --height 0.015 --speed 0.039 --plant model --out o.csv"
    done = subprocess.run(
        ["sh", "-c", f"rmdir ../gone; {COREXY} {words}"], cwd=tmp_path / "gone",
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.startswith("the folder that you are in: No such file or directory")
    assert done.stderr.count("\n") == 1


def test_an_interrupt_while_modules_load_is_quiet(monkeypatch, capsys):
    def interrupted(name):
        raise KeyboardInterrupt

    loading = types.ModuleType("corexy_fmi.cli")
    loading.__getattr__ = interrupted
    monkeypatch.setitem(sys.modules, "corexy_fmi.cli", loading)
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == 130
    assert capsys.readouterr() == ("", "")


def test_what_ignores_a_hang_up_goes_on_doing_so(corexy):
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert corexy("effects", "backlash").returncode == 0
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
