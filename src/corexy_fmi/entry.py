"""The way in: loads the command, so that an interrupt meanwhile is no traceback."""

from __future__ import annotations

import sys

INTERRUPTED = 130


def main() -> None:
    """Run the command line; an interrupt while it loads ends quietly."""
    try:
        from corexy_fmi.cli import main as run

        run()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
