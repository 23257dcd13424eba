"""ARCHITECTURE.md names files that are there, and functions that they hold."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = [
    ROOT / name for name in ("src/corexy_fmi", "fmu_src", "firmware", "benchmarks/mechanism")
]
TEXT = (ROOT / "ARCHITECTURE.md").read_text("utf-8")
CALLS = sorted(set(re.findall(r"(?<![\w/])([\w/]+\.(?:py|c)):([\w.]+\w)", TEXT)))


def sources(name: str) -> list[str]:
    """Files of that name, and of the folder where one is told."""
    name = name.removeprefix("firmware/")
    named = [p for folder in FOLDERS for p in folder.rglob(Path(name).name)]
    return [p.read_text("utf-8") for p in named if f"/{name}" in p.as_posix()]


def test_there_are_calls_to_check():
    assert len(CALLS) > 150


@pytest.mark.parametrize(("name", "called"), CALLS)
def test_what_is_called_is_defined(name, called):
    patterns = [rf"(def|class) {what}\b|^[\w *]*\b{what}\(" for what in called.split(".")]
    assert any(all(re.search(p, text, re.M) for p in patterns) for text in sources(name)), called
