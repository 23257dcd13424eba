"""The FMU's shared library: generic, for any machine; compiled once, cached, never for one CPU."""

from __future__ import annotations

import hashlib
import platform
import tempfile
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

from corexy_fmi.fmu.c_table import variables_header
from corexy_fmi.fmu.variables import interface_guid, variable_table
from corexy_fmi.kernel.compiler import (
    FLAGS,
    STAGE_HEADERS,
    SUFFIX,
    cache_folder,
    compile_library,
    find_compiler,
    native_sources,
    portable_flags,
)
from corexy_fmi.kernel.generate import generated_header, sizes_header
from corexy_fmi.kernel.layout import Layout

IDENTIFIER = "CoreXY"
C_FILES = (
    "fmi2.c",
    "fmi2_instance.c",
    "fmi2_values.c",
    "fmi2_derivatives.c",
    "fmi2_state.c",
    "machine_file.c",
    "slave.c",
    "slave_derivatives.c",
    "stage.c",
)
HEADERS = ("fmi2_instance.h", "machine_file.h", "slave.h", *STAGE_HEADERS)
STANDARD = ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h")


def library_guid(layout: Layout) -> str:
    """The GUID that the library answers to."""
    return interface_guid(variable_table(layout), IDENTIFIER)


@lru_cache(maxsize=8)
def source_texts(layout: Layout) -> Mapping[str, str]:
    """All sources of the library by file name, generated headers included; once for a layout."""
    native = native_sources()
    paths = [native / name for name in (*C_FILES, *HEADERS)]
    paths += [native / "fmi2" / name for name in STANDARD]
    texts = {path.name: path.read_text(encoding="utf-8") for path in paths}
    texts["stage_sizes.h"] = sizes_header(layout)
    texts["stage_generated.h"] = generated_header(layout)
    texts["fmi2_variables.h"] = variables_header(
        variable_table(layout), layout, library_guid(layout)
    )
    return MappingProxyType(dict(sorted(texts.items())))


def _fingerprint(texts: Mapping[str, str]) -> str:
    """Hash of sources, flags and platform; not of the compiler, which may be gone by now."""
    parts = [
        platform.system(),
        platform.machine(),
        *FLAGS,
        *(f"{k}\n{v}" for k, v in texts.items()),
    ]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:20]


def fmu_library(layout: Layout) -> Path:
    """Path of the compiled library, from the cache where it is there.

    Two builds at once each compile beside and rename: both end with the same file.
    Raises InputError where there is no compiler and the cache does not hold it.
    """
    texts = source_texts(layout)
    target = cache_folder() / f"fmu-{_fingerprint(texts)}{SUFFIX}"
    if not target.exists():
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write_sources(folder, texts)
            flags = (f"-I{folder}", *portable_flags(find_compiler()))
            compile_library([folder / file for file in C_FILES], target, *flags)
    return target


def write_sources(folder: Path, texts: Mapping[str, str]) -> None:
    """Write source texts under their names."""
    for file, text in texts.items():
        (folder / file).write_text(text, encoding="utf-8", newline="\n")
