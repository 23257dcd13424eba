"""Parquet through pyarrow, an optional extra."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from corexy_fmi.errors import InputError
from corexy_fmi.sweep.chunk import Columns

MISSING = "pyarrow is missing, expected it for Parquet: pip install 'corexy_fmi[sweep]'"


def pyarrow() -> Any:
    """The module, with its parquet; raises InputError with the line that installs it."""
    try:
        import pyarrow as found
        import pyarrow.parquet
    except ImportError as error:
        raise InputError(MISSING) from error
    return found


def write_table(columns: Columns, about: Mapping[str, str], path: Path) -> None:
    """Write columns, each (n,), with metadata; the same bytes for the same content."""
    arrow = pyarrow()
    table = arrow.table(dict(columns)).replace_schema_metadata(dict(about))
    arrow.parquet.write_table(table, path)
