"""Without the emulated board these tests skip, and the run ends with what installs it."""

from __future__ import annotations

import pytest

from tests.hil.emulator import INSTALL, missing

EMULATED = "needs the emulated board: "
BARE = ("test_plan", "test_grbl")  # tests that need none


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    lacks = missing()
    for item in items:
        if lacks and "tests/hil" in item.path.as_posix() and not item.path.name.startswith(BARE):
            item.add_marker(pytest.mark.skip(reason=f"{EMULATED}no {lacks}; {INSTALL}"))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    skipped = [r for r in terminalreporter.stats.get("skipped", []) if EMULATED in str(r.longrepr)]
    if skipped:
        terminalreporter.section("hardware in the loop")
        terminalreporter.line(f"{len(skipped)} tests skipped; they run after: {INSTALL}")
