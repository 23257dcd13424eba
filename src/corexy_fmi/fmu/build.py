"""Build an FMU: the generic library once, then an archive for each machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import fmpy

from corexy_fmi.effects.api import Effect
from corexy_fmi.errors import InputError
from corexy_fmi.fmu.archive import write_archive
from corexy_fmi.fmu.description import FLAVOURS, NATIVE, Flavour, model_description
from corexy_fmi.fmu.document import LICENCE_TEXT, index_page
from corexy_fmi.fmu.library import C_FILES, fmu_library, library_guid, source_texts
from corexy_fmi.fmu.machine_text import machine_text
from corexy_fmi.fmu.platforms import platform_binaries
from corexy_fmi.fmu.python_slave import python_files
from corexy_fmi.fmu.reference import reference_files
from corexy_fmi.fmu.variables import Variable, interface_guid, machine_table
from corexy_fmi.kernel.compiler import native_sources
from corexy_fmi.kernel.layout import Layout, bundled_layout, make_layout
from corexy_fmi.machine import Machine, load_machine, machine_to_toml

TEMPLATE = "yin2018"


def build_fmu(
    out_dir: Path,
    machine: Machine | None = None,
    flavour: str = "native",
    effects: Mapping[str, Effect] | None = None,
    *,
    all_platforms: bool = False,
) -> Path:
    """Write the FMU of a machine, ``CoreXY.fmu`` or ``CoreXYPython.fmu``, and give its path.

    ``flavour`` is "native" or "python"; without a machine it holds `yin2018` with every effect
    neutral.  ``effects`` are all known effects where a user's own are among them.  A C compiler is
    needed only where the library for this set of effects is not in the cache.  ``all_platforms``
    puts the binaries of `corexy_fmi.fmu.platforms` inside; that needs zig.
    Raises InputError where it is needed and absent, for a value out of range, for a flavour that
    this platform has no binary of, and where the folder cannot be written.
    """
    kind = _flavour(flavour, all_platforms)
    layout = bundled_layout() if effects is None else make_layout(effects)
    chosen = load_machine(TEMPLATE) if machine is None else machine
    path = Path(out_dir) / f"{kind.identifier}.fmu"
    write_archive(path, fmu_content(chosen, kind, layout, all_platforms=all_platforms))
    return path


def _flavour(name: str, all_platforms: bool) -> Flavour:
    if name not in FLAVOURS:
        raise InputError(f"flavour: found {name!r}, expected one of {', '.join(FLAVOURS)}")
    if all_platforms and FLAVOURS[name] is not NATIVE:
        raise InputError(f"flavour: found {name!r}, expected native for all platforms")
    return FLAVOURS[name]


def fmu_content(
    machine: Machine, flavour: Flavour, layout: Layout, *, all_platforms: bool = False
) -> dict[str, bytes]:
    """Every file of the FMU by its name in the archive."""
    table = machine_table(machine, layout)
    guid = interface_guid(table, flavour.identifier)
    sources = C_FILES if flavour is NATIVE else ()
    description = model_description(table, flavour, guid, machine.name, sources)
    content = _common(table, machine, layout) | {"modelDescription.xml": description}
    if flavour is NATIVE:
        binaries = platform_binaries(layout) if all_platforms else _binaries(layout, flavour)
        more = binaries | _sources(layout)
    else:
        library = fmu_library(layout).read_bytes()
        more = python_files(description, library, library_guid(layout), content)
    return content | more | _reference(table, machine, layout, flavour)


def _reference(
    table: Sequence[Variable], machine: Machine, layout: Layout, flavour: Flavour
) -> dict[str, bytes]:
    """Input and results that a native FMU of the machine gives on this host, to the same bits."""
    guid = library_guid(layout)
    native = {
        "modelDescription.xml": model_description(table, NATIVE, guid, machine.name),
        "resources/machine.txt": machine_text(table, machine, guid),
        **_binaries(layout, NATIVE),
    }
    return reference_files(machine, native, flavour.identifier)


def _common(table: Sequence[Variable], machine: Machine, layout: Layout) -> dict[str, bytes]:
    """The machine, for C and for people, the documentation and the icon."""
    laws = list({i.effect.name: i.effect for i in layout.instances}.values())
    return {
        "resources/machine.txt": machine_text(table, machine, library_guid(layout)),
        "resources/machine.toml": machine_to_toml(machine).encode(),
        "documentation/index.html": index_page(table, machine, laws).encode(),
        "documentation/licenses/license.txt": LICENCE_TEXT.encode(),
        "model.png": (native_sources().parent / "model.png").read_bytes(),
    }


def binary_folders() -> tuple[str, ...]:
    """Folders for this host's binary: where fmpy looks, and FMI 2.0.5's name where that differs.

    fmpy takes the 64-bit name of the system on every processor ("linux64" on aarch64 too).
    """
    return (
        (fmpy.platform,) if fmpy.architecture == "x86_64" else (fmpy.platform, fmpy.platform_tuple)
    )


def _binaries(layout: Layout, flavour: Flavour) -> dict[str, bytes]:
    library = fmu_library(layout).read_bytes()
    name = f"{flavour.identifier}{fmpy.sharedLibraryExtension}"
    return {f"binaries/{folder}/{name}": library for folder in binary_folders()}


def _sources(layout: Layout) -> dict[str, bytes]:
    return {f"sources/{name}": text.encode() for name, text in source_texts(layout).items()}
