"""Outputs are whole or absent."""

import errno
import os
import threading
from pathlib import Path

import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.files import alone_in, write_beside, write_folder


def stop_after(path, error):
    path.write_text("half")
    raise error


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_an_interrupted_file_leaves_nothing(tmp_path, error):
    path = tmp_path / "result.csv"
    path.write_text("old")
    for place in (path, tmp_path / "a" / "b" / "c"):
        with pytest.raises(error), write_beside(place) as beside:
            stop_after(beside, error)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
@pytest.mark.parametrize("place", ["result", "a/b/result"])
def test_an_interrupted_folder_leaves_nothing(tmp_path, error, place):
    with pytest.raises(error), write_folder(tmp_path / place) as folder:
        stop_after(folder / "a", error)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_made_on_the_way_stays_where_others_use_it(tmp_path):
    with pytest.raises(KeyError), write_beside(tmp_path / "a" / "b" / "c"):
        stop_after(tmp_path / "a" / "others", KeyError)
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["others"]


def test_a_folder_keeps_what_else_it_holds(tmp_path):
    (tmp_path / "kept").write_text("mine")
    with write_folder(tmp_path) as folder:
        (folder / "new").write_text("new")
    assert {path.name for path in tmp_path.iterdir()} == {"kept", "new"}


def test_a_result_replaces_all_of_the_one_before(tmp_path):
    for name in ("kept", "a", "b"):
        (tmp_path / name).write_text("old")
    with write_folder(tmp_path, replacing=("a", "b")) as folder:
        (folder / "a").write_text("new")
        assert (tmp_path / "b").exists()
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"kept": "old", "a": "new"}


def test_folders_on_the_way_are_made(tmp_path):
    with write_beside(tmp_path / "a" / "b" / "c.txt") as beside:
        assert beside.suffix == ".txt"
        beside.write_text("whole")
    assert (tmp_path / "a" / "b" / "c.txt").read_text() == "whole"


def test_a_link_stays_and_leads_to_what_is_written(tmp_path):
    (tmp_path / "far").mkdir()
    (tmp_path / "far" / "there").write_text("old")
    for name, target in (("link", "far/there"), ("dangling", "far/new"), ("folder", "far")):
        (tmp_path / name).symlink_to(target)
    for name in ("link", "dangling"):
        with write_beside(tmp_path / name) as beside:
            beside.write_text("whole")
    with write_folder(tmp_path / "folder") as folder:
        (folder / "inner").write_text("whole")
    assert all((tmp_path / name).is_symlink() for name in ("link", "dangling", "folder"))
    assert {path.name: path.read_text() for path in (tmp_path / "far").iterdir()} == {
        "there": "whole", "new": "whole", "inner": "whole",
    }  # fmt: skip


@pytest.mark.skipif(os.name == "nt", reason="modes of POSIX")
@pytest.mark.parametrize("mode", [0o600, 0o664])
def test_a_file_keeps_its_mode(tmp_path, mode):
    path = tmp_path / "result.csv"
    path.write_text("old")
    path.chmod(mode)
    with write_beside(path) as beside:
        beside.write_text("new")
    assert (path.read_text(), path.stat().st_mode & 0o777) == ("new", mode)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="FIFOs of POSIX")
def test_a_fifo_takes_the_whole_and_stays(tmp_path):
    path, got = tmp_path / "pipe.csv", []
    os.mkfifo(path)
    reader = threading.Thread(target=lambda: got.append(path.read_text()), daemon=True)
    reader.start()
    with write_beside(path) as beside:
        beside.write_text("whole")
        assert beside.read_text() == "whole"
    reader.join(10)
    assert got == ["whole"]
    assert path.is_fifo()
    assert list(tmp_path.iterdir()) == [path]


def test_this_folder_is_a_folder_and_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with write_folder(Path(".")) as folder:
        (folder / "a").write_text("new")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    with pytest.raises(InputError, match="has no name"), write_beside(Path(".")):
        pass


def test_a_place_that_cannot_be_written_is_the_users_mistake(tmp_path):
    (tmp_path / "file").write_text("")
    for way in ("file/x", "file/a/x", "file/a/b/x"):
        for write in (write_beside, write_folder, alone_in):
            with pytest.raises(InputError, match="cannot be written"), write(tmp_path / way):
                pass
    with pytest.raises(InputError, match="cannot be written"), write_folder(tmp_path / "file"):
        pass


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="a folder that nobody writes, of Linux")
@pytest.mark.parametrize("write", [write_beside, write_folder, alone_in])
@pytest.mark.parametrize("way", ["a", "a/b", "a/b/c"])
def test_so_is_one_many_folders_below_such_a_place(write, way):
    with pytest.raises(InputError, match=rf"{way}.*: cannot be written"), write(Path("/proc", way)):
        pass


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_no_room_names_what_was_to_be_written(tmp_path, number):
    with (
        pytest.raises(InputError, match=r"o.csv: cannot be written: .*, expected a place"),
        write_beside(tmp_path / "o.csv"),
    ):
        raise OSError(number, os.strerror(number))  # a write names no file
    assert list(tmp_path.iterdir()) == []


def test_other_errors_of_the_file_system_pass(tmp_path):
    with pytest.raises(FileNotFoundError), write_beside(tmp_path / "x"):
        open("/nowhere/at/all")  # noqa: SIM115


def test_a_folder_is_one_runs_alone(tmp_path):
    place = tmp_path / "new" / "out"
    with alone_in(place):
        with pytest.raises(InputError, match="another run is at work") as told, alone_in(place):
            pass
        assert str(told.value).startswith(f"{place}: ")
        (place / "row").write_text("done")
    with pytest.raises(KeyError), alone_in(tmp_path / "empty" / "out"):
        raise KeyError
    assert not (tmp_path / "empty").exists()
    with alone_in(place):
        pass
    assert [path.name for path in place.iterdir()] == ["row"]


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"), alone_in(tmp_path / "file" / "out"):
        pass
