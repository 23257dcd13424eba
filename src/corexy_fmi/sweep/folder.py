"""A sweep's folder: a manifest of what it is, a ledger of what is done, one file a chunk.

    manifest.json        what the results depend on; another sweep is refused
    chunks.jsonl         one line for each finished chunk: its number, rows, SHA-256
    sets/NNNNNN.parquet  the chunks

A chunk counts as done where the ledger has its line and the file has that hash; all else is redone.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from corexy_fmi.errors import InputError
from corexy_fmi.files import write_beside
from corexy_fmi.sweep.chunk import Columns
from corexy_fmi.sweep.parquet import pyarrow, write_table

MANIFEST, LEDGER, SETS = "manifest.json", "chunks.jsonl", "sets"


class Folder:
    """Where a sweep's results are kept; nothing is written before `open`."""

    def __init__(self, path: Path, document: Mapping[str, Any], about: Mapping[str, str]) -> None:
        """``document`` is all that the results depend on, ``about`` the metadata of each file."""
        self.path, self.about = path, dict(about)
        self.document = json.loads(json.dumps(document))

    def open(self) -> set[int]:
        """Begin or go on; the numbers of the chunks that are whole.

        Raises InputError where the folder holds another sweep or something else.
        """
        pyarrow()
        self.check()
        if not (self.path / MANIFEST).exists():
            with write_beside(self.path / MANIFEST) as beside:
                beside.write_text(json.dumps(self.document, indent=1) + "\n", encoding="utf-8")
        for stray in (*self.path.glob(".manifest-*"), *self.path.glob(".chunks-*")):
            stray.unlink()
        for stray in (self.path / SETS).glob(".*.parquet"):
            stray.unlink()
        whole = {n: entry for n, entry in self._ledger().items() if self._is_whole(n, entry)}
        with write_beside(self.path / LEDGER) as beside:
            lines = [json.dumps(whole[n]) + "\n" for n in sorted(whole)]
            beside.write_text("".join(lines), encoding="utf-8")
        return set(whole)

    def keep(self, index: int, columns: Columns) -> None:
        """Write a chunk, and then its line."""
        with write_beside(self.file(index)) as beside:
            write_table(columns, self.about, beside)
            digest = _hash(beside)
        entry = {"chunk": index, "rows": len(columns["set"]), "sha256": digest}
        with (self.path / LEDGER).open("a", encoding="utf-8") as ledger:
            ledger.write(json.dumps(entry) + "\n")

    def file(self, index: int) -> Path:
        """Where a chunk lies."""
        return self.path / SETS / f"{index:06d}.parquet"

    def check(self) -> None:
        """Raises InputError where the folder holds another sweep or something else."""
        if self.path.exists() and not self.path.is_dir():
            raise InputError(f"{self.path}: found a file, expected a folder")
        if (manifest := self.path / MANIFEST).exists():
            self._refuse_another(_read(manifest))
        elif self.path.exists() and any(p.name[0] != "." for p in self.path.iterdir()):
            raise InputError(
                f"{self.path}: found files and no {MANIFEST}, expected an empty folder or a sweep's"
            )

    def _refuse_another(self, held: Any) -> None:
        for key in {**self.document, **held}:
            theirs, ours = held.get(key), self.document.get(key)
            if theirs != ours:
                raise InputError(
                    f"{self.path}: holds another sweep, {key} is {_short(theirs, ours)}, "
                    f"found {_short(ours, theirs)}; expected the same command or another --out"
                )

    def _ledger(self) -> dict[int, dict[str, Any]]:
        """The ledger's lines by chunk; a torn line is passed over."""
        path, found = self.path / LEDGER, {}
        for line in path.read_text("utf-8", "replace").splitlines() if path.exists() else ():
            try:
                entry = json.loads(line)
                found[int(entry["chunk"])] = entry
            except (ValueError, TypeError, KeyError):
                continue
        return found

    def _is_whole(self, index: int, entry: Mapping[str, Any]) -> bool:
        return self.file(index).is_file() and _hash(self.file(index)) == entry.get("sha256")


def _read(manifest: Path) -> dict[str, Any]:
    try:
        document = json.loads(manifest.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{manifest}: cannot be read, expected a sweep's manifest") from error
    if not isinstance(document, dict):
        raise InputError(f"{manifest}: found no table, expected a sweep's manifest")
    return document


def _short(value: Any, other: Any) -> str:
    """A value on one line, of a long text what differs first."""
    if isinstance(value, str) and isinstance(other, str):
        theirs = set(other.splitlines())
        value = next((x for x in value.splitlines() if x not in theirs), value)
    text = " ".join(str(value).split())
    return text if len(text) <= 100 else text[:97] + "..."


def _hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
