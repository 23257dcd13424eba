"""Outputs are whole or absent."""

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
    with pytest.raises(error), write_beside(path) as beside:
        stop_after(beside, error)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_interrupted_folder_leaves_nothing(tmp_path, error):
    with pytest.raises(error), write_folder(tmp_path / "result") as folder:
        stop_after(folder / "a", error)
    assert list(tmp_path.iterdir()) == []


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


def test_this_folder_is_a_folder_and_no_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with write_folder(Path(".")) as folder:
        (folder / "a").write_text("new")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    with pytest.raises(InputError, match="has no name"), write_beside(Path(".")):
        pass


def test_a_place_that_cannot_be_written_is_the_users_mistake(tmp_path):
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(InputError, match="cannot be written"),
        write_beside(tmp_path / "file" / "x"),
    ):
        pass
    with pytest.raises(InputError, match="cannot be written"), write_folder(tmp_path / "file"):
        pass


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
    with alone_in(place):
        pass
    assert [path.name for path in place.iterdir()] == ["row"]


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"), alone_in(tmp_path / "file" / "out"):
        pass
