"""The independent plant of the blind proof: concealed cases from a simulator of its own."""

import hashlib
from pathlib import Path

import numba

# numba's cache looks at one file at a time, but compiled code holds constants and functions of
# several: so the cache lies in a folder named after all sources but those that none of it reads
TABLES = {f"{n}.py" for n in ("case", "effects", "more", "outside", "planted", "scale", "world")}
_here = Path(__file__).parent
_sources = b"".join(p.read_bytes() for p in sorted(_here.glob("*.py")) if p.name not in TABLES)
_before = numba.config.CACHE_DIR
numba.config.CACHE_DIR = str(_here / "__pycache__" / hashlib.sha256(_sources).hexdigest()[:12])

from .case import Case, draw, perform, seal, twin, write  # noqa: E402

numba.config.CACHE_DIR = _before

__all__ = ["Case", "draw", "perform", "seal", "twin", "write"]
