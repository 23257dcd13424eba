"""The machines of a folder: one subfolder each, with recordings and perhaps a machine file."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from corexy_fmi import __version__
from corexy_fmi.errors import InputError

MACHINE = "machine.toml"
JUDGES = re.compile(r"(holdout.*|H\d*)\.csv", re.IGNORECASE)  # held_out.csv, home.csv are training
NO_RECORDINGS = "no recordings, expected *.csv, some of which may be named holdout*.csv or H1.csv"


@dataclass(frozen=True)
class Parcel:
    """All that a diagnosis of one machine needs, so that it can be done anywhere.

    ``files`` holds the bytes of recordings and machine file by name; ``machine`` names the bundled
    one to take, or the file among them; None lets the recordings decide.
    """

    name: str
    files: Mapping[str, bytes]
    train: tuple[str, ...]
    holdout: tuple[str, ...]
    machine: str | None

    @property
    def fingerprint(self) -> str:
        """Hash of files, machine and what is kept back, and of the package's version."""
        digest = hashlib.sha256(f"{__version__}\0{self.machine}\0{self.holdout}".encode())
        for name in sorted(self.files):
            digest.update(f"\0{name}\0{len(self.files[name])}\0".encode())
            digest.update(self.files[name])
        return digest.hexdigest()


def find_machines(folder: Path) -> list[Path]:
    """The subfolders of a folder by name, hidden ones left out.

    Raises InputError where there are none.
    """
    try:
        found = sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith("."))
    except OSError as error:
        raise InputError(f"{folder}: {error.strerror}, expected a folder of machines") from error
    if not found:
        raise InputError(f"{folder}: no subfolders, expected one for each machine")
    return found


def read_parcel(folder: Path, machine: str | None = None) -> Parcel:
    """The recordings and the machine of one subfolder; ``machine``, a file or the name of a bundled
    one, is taken where it has none.

    Recordings named ``holdout*.csv`` or ``H``, ``H1``, ``H2``.. ``.csv`` judge, all others train.
    Raises InputError where there are none to train on, or a file cannot be read.
    """
    recordings = sorted(p for p in folder.glob("*.csv") if not p.name.startswith("."))
    train = tuple(p.name for p in recordings if not JUDGES.fullmatch(p.name))
    if not train:
        raise InputError(NO_RECORDINGS)
    files = {p.name: _read(p) for p in recordings}
    own = folder / MACHINE
    if own.is_file():
        files[MACHINE], machine = _read(own), MACHINE
    elif machine and Path(machine).is_file():
        files[MACHINE], machine = _read(Path(machine)), MACHINE
    holdout = tuple(p.name for p in recordings if p.name not in train)
    return Parcel(folder.name, files, train, holdout, machine)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path.name}: {error.strerror}, expected a file to read") from error
