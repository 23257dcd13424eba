"""A hash of the C that a layout amounts to, kept between processes.

Tracing every effect takes a second of each process, and depends on nothing but the package's
sources, Python and sympy: of those the catalogue's own is remembered beside the kernels.
"""

from __future__ import annotations

import hashlib
import re
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

import sympy

from corexy_fmi.errors import InputError
from corexy_fmi.files import write_beside
from corexy_fmi.kernel.generate import generated_header, sizes_header
from corexy_fmi.kernel.layout import Layout, bundled_layout

PACKAGE = Path(__file__).parents[1]
DIGEST = re.compile("[0-9a-f]{64}")


def traced_digest(layout: Layout, folder: Path) -> str:
    """Hash of a layout's generated C; the bundled one's is looked up and kept in a folder."""
    if layout != bundled_layout():
        return _traced(layout)
    known = folder / f"traced-{_sources()}.txt"
    found = known.read_text(encoding="utf-8") if known.is_file() else ""
    if not DIGEST.fullmatch(found):
        found = _traced(layout)
        with suppress(InputError), write_beside(known) as beside:  # or trace again next time
            beside.write_text(found, encoding="utf-8")
    return found


def _traced(layout: Layout) -> str:
    text = sizes_header(layout) + generated_header(layout)
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def _sources() -> str:
    """Hash of the package's Python files and of what runs them."""
    digest = hashlib.sha256(f"{sys.version}\0{sympy.__version__}\0".encode())
    for file in sorted(PACKAGE.rglob("*.py")):
        content = file.read_bytes()
        digest.update(f"{file.relative_to(PACKAGE)}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()[:20]
