"""Build the FMU: ``python build_fmu.py [--flavour native|python] [--out DIR] ...``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from corexy_fmi.errors import InputError
from corexy_fmi.fmu.build import build_fmu
from corexy_fmi.machine import load_machine


def main() -> int:
    """Write the FMU and print its path; 2 and one line on stderr for bad input."""
    parser = argparse.ArgumentParser(description="Build the FMU (FMI 2.0, co-simulation).")
    parser.add_argument("--flavour", choices=("native", "python"), default="native")
    parser.add_argument("--machine", help="machine file or bundled name that the FMU holds")
    parser.add_argument("--out", type=Path, default=Path("build"), help="folder for it")
    parser.add_argument("--all-platforms", action="store_true", help="needs the wheel ziglang")
    chosen = parser.parse_args()
    try:
        machine = load_machine(chosen.machine) if chosen.machine else None
        built = build_fmu(chosen.out, machine, chosen.flavour, all_platforms=chosen.all_platforms)
        print(built)
    except InputError as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
