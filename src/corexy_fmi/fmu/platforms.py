"""Binaries for other platforms, cross-compiled by the wheel `ziglang` from one machine.

Folders are named as in FMI 2.0.5: the names of FMI 1 for x86-64, tuples as in FMI 3 beside them.
"""

from __future__ import annotations

import hashlib
import importlib.util
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from corexy_fmi.errors import InputError
from corexy_fmi.files import write_beside
from corexy_fmi.fmu.library import C_FILES, IDENTIFIER, source_texts, write_sources
from corexy_fmi.fmu.universal import universal_binary
from corexy_fmi.kernel.compiler import FLAGS, cache_folder, run_compiler
from corexy_fmi.kernel.layout import Layout

MISSING = "binaries for all platforms need zig: pip install ziglang (100 MB)"
SMALL = ("-g0", "-Wl,-s")  # neither debug data nor local symbols
MAC = ("-Wl,-install_name,@rpath/CoreXY.dylib",)  # else the path of the build goes into the file


@dataclass(frozen=True)
class Platform:
    """A target: its name at zig, with the oldest system that it asks for, and its file's ending."""

    target: str
    suffix: str
    flags: tuple[str, ...] = ()


PLATFORMS = {
    "x86_64-linux": Platform("x86_64-linux-gnu.2.17", ".so"),
    "aarch64-linux": Platform("aarch64-linux-gnu.2.17", ".so"),
    "x86_64-windows": Platform("x86_64-windows-gnu", ".dll"),
    "x86_64-darwin": Platform("x86_64-macos.10.13", ".dylib", MAC),
    "aarch64-darwin": Platform("aarch64-macos.11.0", ".dylib", MAC),
}
FOLDERS = {
    "linux64": ("x86_64-linux",),
    "aarch64-linux": ("aarch64-linux",),
    "win64": ("x86_64-windows",),
    "darwin64": ("x86_64-darwin", "aarch64-darwin"),  # one universal file
    "aarch64-darwin": ("aarch64-darwin",),
}


def zig_compiler() -> tuple[str, ...]:
    """Command of zig's C compiler.  Raises InputError with the line that installs it."""
    if importlib.util.find_spec("ziglang") is None:
        raise InputError(MISSING)
    return (sys.executable, "-m", "ziglang", "cc")


def platform_binaries(layout: Layout) -> dict[str, bytes]:
    """The library for every platform by its name in the archive, such as binaries/win64/CoreXY.dll.

    Each is compiled once and cached; zig is needed only where one is not in the cache.
    Raises InputError where it is needed and absent, or fails.
    """
    texts = source_texts(layout)
    built = {name: platform_library(name, texts) for name in PLATFORMS}
    binaries = {}
    for folder, names in FOLDERS.items():
        parts = [built[name] for name in names]
        file = f"binaries/{folder}/{IDENTIFIER}{PLATFORMS[names[0]].suffix}"
        binaries[file] = parts[0] if len(parts) == 1 else universal_binary(parts)
    return binaries


def platform_library(name: str, texts: Mapping[str, str]) -> bytes:
    """The library of one of `PLATFORMS`, compiled from source texts or from the cache."""
    kind = PLATFORMS[name]
    parts = (kind.target, *FLAGS, *SMALL, *kind.flags, *(f"{k}\n{v}" for k, v in texts.items()))
    digest = hashlib.sha256("\0".join(parts).encode()).hexdigest()[:20]
    target = cache_folder() / f"fmu-{name}-{digest}{kind.suffix}"
    if not target.exists():
        _compile(kind, texts, target)
    return target.read_bytes()


def _compile(kind: Platform, texts: Mapping[str, str], target: Path) -> None:
    """The file's own name goes into some formats: so it is made under the name it has in an FMU."""
    compiler = zig_compiler()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_sources(folder, texts)
        made = folder / f"{IDENTIFIER}{kind.suffix}"
        flags = ["-target", kind.target, *FLAGS, *SMALL, *kind.flags]
        run_compiler([*compiler, *flags, "-shared", *C_FILES, "-o", made.name, "-lm"], folder)
        with write_beside(target) as beside:
            beside.write_bytes(made.read_bytes())
