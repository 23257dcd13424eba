"""Odd recordings: a few here, more by `python -m benchmarks.odd_recordings`."""

from __future__ import annotations

import json
import sys

import pytest

from benchmarks import odd_recordings

QUICK = (1004, 1006, 1013, 1025, 1045, 1051, 1056)  # seconds each
REFUSED = (1001, 1003, 1034)


@pytest.mark.long
@pytest.mark.parametrize("seed", QUICK)
def test_they_get_a_verdict(seed: int) -> None:
    word, told = odd_recordings.outcome(seed)
    assert word in ("explained", "ambiguous", "unexplained", "nothing_missing"), told


SAID = ("csv: no measured channel that can be fitted has more", "expected a number within 1e+12")


@pytest.mark.parametrize("seed", REFUSED)
def test_or_one_line(seed: int) -> None:
    word, told = odd_recordings.outcome(seed)
    assert word == "refused"
    assert any(words in told for words in SAID)


def broken(error: Exception | None, status: int = 0) -> object:
    def run() -> int:
        if error:
            raise error
        return status

    return run


@pytest.mark.parametrize(
    ("run", "word", "told"),
    [
        (broken(ValueError("an empty sequence")), "broke down", "ValueError: an empty sequence"),
        (broken(None, 2), "broke down", "status 2: "),
        (broken(None, 130), "broke down", "status 130: "),
    ],
)
def test_what_breaks_down_is_seen(monkeypatch, run, word, told):
    monkeypatch.setattr(odd_recordings.cli, "run", run)
    assert odd_recordings.outcome(1004) == (word, told)


def test_a_warning_is_seen(monkeypatch):
    def run() -> int:
        import warnings

        warnings.warn("divide by zero", RuntimeWarning, stacklevel=1)
        return 0

    monkeypatch.setattr(odd_recordings.cli, "run", run)
    assert odd_recordings.outcome(1004) == ("warned", "divide by zero")


def test_the_table_names_what_went_wrong(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(odd_recordings, "RESULT", tmp_path / "odd.json")
    monkeypatch.setattr(odd_recordings.cli, "run", broken(ValueError("here")))
    monkeypatch.setattr(sys, "argv", ["odd", "--first", "1004", "--count", "1"])
    odd_recordings.main()
    kept = json.loads((tmp_path / "odd.json").read_text())
    assert kept["outcomes"] == {"broke down": 1}
    assert kept["wrong"] == {"1004": "ValueError: here"}
    assert "1004: broke down: ValueError: here" in capsys.readouterr().out
