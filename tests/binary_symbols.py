"""Processor, exported names and signature of 64-bit ELF, PE and Mach-O files."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator

ELF_MACHINES = {62: "x86_64", 183: "aarch64"}
MACH_MACHINES = {0x01000007: "x86_64", 0x0100000C: "aarch64"}
DYNAMIC_SYMBOLS, LOAD_SYMBOLS, LOAD_SIGNATURE = 11, 2, 0x1D
WEAK = 2


def text(data: bytes, at: int) -> str:
    """The zero-terminated string at a place."""
    return data[at : data.index(b"\0", at)].decode()


def parts(data: bytes) -> dict[str, set[str]]:
    """Exported names by "system processor" of a file; a universal one has several."""
    if data[:4] == b"\x7fELF":
        return {f"linux {ELF_MACHINES[struct.unpack_from('<H', data, 18)[0]]}": set(elf(data))}
    if data[:2] == b"MZ":
        return {"windows x86_64": set(pe(data))}
    if data[:4] == b"\xca\xfe\xba\xbe":
        found: dict[str, set[str]] = {}
        for i in range(struct.unpack_from(">I", data, 4)[0]):
            cpu, _, start, size, power = struct.unpack_from(">IIIII", data, 8 + 20 * i)
            assert start % (1 << power) == 0
            (name, names), *rest = parts(data[start : start + size]).items()
            assert (name, rest) == (f"darwin {MACH_MACHINES[cpu]}", [])
            found[name] = names
        return found
    assert data[:4] == b"\xcf\xfa\xed\xfe"
    return {f"darwin {MACH_MACHINES[struct.unpack_from('<I', data, 4)[0]]}": set(mach(data))}


def imports(data: bytes) -> set[str]:
    """Names that an ELF file must find elsewhere."""
    return set(elf(data, defined=False))


def elf(data: bytes, *, defined: bool = True) -> Iterator[str]:
    """Defined names of the dynamic symbol table, or those that are needed and not weak."""
    (table,), size, count = struct.unpack_from("<Q", data, 40), *struct.unpack_from("<HH", data, 58)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, table + size * i) for i in range(count)]
    for _, kind, _, _, start, length, link, *_ in sections:
        if kind == DYNAMIC_SYMBOLS:
            for at in range(start + 24, start + length, 24):
                name, binding, _, section = struct.unpack_from("<IBBH", data, at)
                if bool(section) == defined and (defined or binding >> 4 != WEAK):
                    yield text(data, sections[link][4] + name)


def pe(data: bytes) -> Iterator[str]:
    """Names of the export directory."""
    (head,) = struct.unpack_from("<I", data, 60)
    machine, count = struct.unpack_from("<HH", data, head + 4)
    (optional,) = struct.unpack_from("<H", data, head + 20)
    assert machine == 0x8664
    table = head + 24 + optional
    sections = [struct.unpack_from("<IIII", data, table + 40 * i + 8) for i in range(count)]

    def place(address: int) -> int:
        return next(r + address - v for s, v, n, r in sections if v <= address < v + max(s, n))

    (directory,) = struct.unpack_from("<I", data, head + 24 + 112)
    count, _, addresses = struct.unpack_from("<III", data, place(directory) + 24)
    for i in range(count):
        yield text(data, place(struct.unpack_from("<I", data, place(addresses) + 4 * i)[0]))


def mach(data: bytes) -> Iterator[str]:
    """External defined names without their underscore, and without the linker's own two."""
    at = 32
    for _ in range(struct.unpack_from("<I", data, 16)[0]):
        command, size = struct.unpack_from("<II", data, at)
        if command == LOAD_SYMBOLS:
            symbols, count, strings, _ = struct.unpack_from("<IIII", data, at + 8)
            for i in range(count):
                name, kind = struct.unpack_from("<IB", data, symbols + 16 * i)
                word = text(data, strings + name)
                if kind & 1 and kind & 0xE and word not in ("__mh_dylib_header", "___dso_handle"):
                    yield word[1:]
        at += size


def signed_pages(data: bytes) -> list[bool]:
    """Whether each page of a Mach-O file has the SHA-256 that its ad hoc signature tells.

    Empty without a signature.  Blobs as in Apple's <kern/cs_blobs.h>.
    """
    at = 32
    for _ in range(struct.unpack_from("<I", data, 16)[0]):
        command, size = struct.unpack_from("<II", data, at)
        if command == LOAD_SIGNATURE:
            (start,) = struct.unpack_from("<I", data, at + 8)
            (first,) = struct.unpack_from(">I", data, start + 16)
            return _pages(data, start + first)
        at += size
    return []


def _pages(data: bytes, directory: int) -> list[bool]:
    hashes, _, _, count, limit = struct.unpack_from(">IIIII", data, directory + 16)
    length, _, _, power = struct.unpack_from(">BBBB", data, directory + 36)
    told = [data[directory + hashes + length * k :][:length] for k in range(count)]
    ends = [min(limit, (k + 1) << power) for k in range(count)]
    return [hashlib.sha256(data[k << power : ends[k]]).digest() == told[k] for k in range(count)]
