"""macOS universal files: several Mach-O files behind one header, as Apple's <mach-o/fat.h> says."""

from __future__ import annotations

import struct
from collections.abc import Sequence

FAT_MAGIC = 0xCAFEBABE  # the header is big-endian
MACH_MAGIC = 0xFEEDFACF  # 64 bit, little-endian
ALIGNMENT = 14  # [power of two] a page of 16 KiB, the largest of both processors
HEADER, ENTRY = struct.Struct(">II"), struct.Struct(">IIIII")


def universal_binary(files: Sequence[bytes]) -> bytes:
    """One file that holds 64-bit Mach-O files of different processors, unchanged.

    Raises ValueError where a part is none, or two are for the same processor.
    """
    processors = [_processor(data) for data in files]
    if len(set(processors)) != len(files):
        raise ValueError("expected files for different processors")
    entries, body = b"", b""
    start = _padded(HEADER.size + ENTRY.size * len(files))
    for processor, data in zip(processors, files, strict=True):
        body += bytes(_padded(len(body)) - len(body))
        entries += ENTRY.pack(*processor, start + len(body), len(data), ALIGNMENT)
        body += data
    head = HEADER.pack(FAT_MAGIC, len(files)) + entries
    return head + bytes(start - len(head)) + body


def _processor(data: bytes) -> tuple[int, int]:
    """CPU type and subtype."""
    magic, kind, subtype = struct.unpack_from("<III", data)
    if magic != MACH_MAGIC:
        raise ValueError(f"found magic {magic:#x}, expected a 64-bit Mach-O file")
    return kind, subtype


def _padded(size: int) -> int:
    return -(-size >> ALIGNMENT) << ALIGNMENT
