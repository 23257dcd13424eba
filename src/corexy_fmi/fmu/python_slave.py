"""The pythonfmu flavour's files: the slave of `fmu_src/corexy_slave.py` under a name of its own."""

from __future__ import annotations

import hashlib
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import files
from pathlib import Path

import fmpy
from pythonfmu.builder import FmuBuilder

from corexy_fmi.errors import InputError
from corexy_fmi.fmu.archive import read_archive
from corexy_fmi.kernel.compiler import native_sources


def python_files(
    description: bytes, library: bytes, guid: str, content: Mapping[str, bytes]
) -> dict[str, bytes]:
    """What pythonfmu adds to the FMU: its binary for this platform, and resources/.

    Modules of one name clash inside a process, so the slave's is unique to what it is built from.
    ``content`` holds the resources of the machine.
    Raises InputError where pythonfmu has no binary for this platform.
    """
    script = (native_sources().parent / "corexy_slave.py").read_bytes()
    digest = hashlib.sha256(script + library + description).hexdigest()[:12]
    name = f"corexy_slave_{digest}"
    ours = {
        f"{name}.py": script,
        f"{name}.library{fmpy.sharedLibraryExtension}": library,
        f"{name}.guid": guid.encode(),
        f"{name}.xml": description,
    }
    resources = {Path(k).name: v for k, v in content.items() if k.startswith("resources/")}
    built = _built_by_pythonfmu(name, ours | resources)
    built.pop(f"resources/{name}.xml")  # it was needed to build; modelDescription.xml is the same
    return built | {"documentation/licenses/pythonfmu.txt": _licence()}


def _licence() -> bytes:
    """The licence of pythonfmu, whose files travel in resources/."""
    parts = [part for part in files("pythonfmu") or () if part.name == "LICENSE"]
    return Path(str(parts[0].locate())).read_bytes() if parts else b"pythonfmu: MIT licence\n"


def _built_by_pythonfmu(name: str, parts: Mapping[str, bytes]) -> dict[str, bytes]:
    """The archive that pythonfmu makes, without its description and other platforms' binaries."""
    with tempfile.TemporaryDirectory(prefix="corexy-slave-") as place, _clean_imports(name):
        folder = Path(place)
        for file, data in parts.items():
            (folder / file).write_bytes(data)
        others = [folder / file for file in parts if file != f"{name}.py"]
        built = read_archive(FmuBuilder.build_FMU(folder / f"{name}.py", folder / "out", others))
    here = f"binaries/{fmpy.platform}/"
    if fmpy.architecture != "x86_64" or not any(file.startswith(here) for file in built):
        raise InputError(
            f"flavour python: pythonfmu has no binary for {fmpy.platform_tuple}, "
            "expected flavour native"
        )
    return {
        file: data
        for file, data in built.items()
        if file != "modelDescription.xml" and (file.startswith(("resources/", here)))
    }


@contextmanager
def _clean_imports(name: str) -> Iterator[None]:
    """pythonfmu leaves its folder in sys.path and the slave in sys.modules."""
    before = list(sys.path)
    try:
        yield
    finally:
        sys.path[:] = before
        sys.modules.pop(name, None)
