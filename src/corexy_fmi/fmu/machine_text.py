"""The machine that travels inside an FMU: `resources/machine.txt`, read by `machine_file.c`."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from corexy_fmi.errors import InputError
from corexy_fmi.fmu.variables import ENUMERATIONS, Variable
from corexy_fmi.machine import Machine

OFFSET, PRIME, MASK = 14695981039346656037, 1099511628211, (1 << 64) - 1


def machine_text(table: Sequence[Variable], machine: Machine, guid: str) -> bytes:
    """Name, drive, fidelity and every kernel parameter of a table with its start values.

    Numbers are IEEE bits in hex, so that no locale can bend them; behind them, to be read by
    people, name, value and unit.  The last line is a checksum (FNV-1a) of all lines before.
    Raises InputError for a value outside the table's range.
    """
    parameters = [v for v in table if v.role == "parameter"]
    lines = ["corexy-machine 1", f"interface {guid}", f"name {_one_line(machine.name)}"]
    for choice, value in (("Drive", machine.drive), ("Fidelity", machine.stage)):
        lines.append(f"{choice.lower()} {list(ENUMERATIONS[choice]).index(value) + 1} {value}")
    lines.append(f"count {len(parameters)}")
    lines += [_parameter_line(variable, machine.name) for variable in parameters]
    body = "".join(f"{line}\n" for line in lines).encode()
    return body + f"checksum {fnv1a(body):016x}\n".encode()


def _parameter_line(variable: Variable, machine: str) -> str:
    """The kernel's value: an enumeration counts from 0 there."""
    start, lower, upper = (
        v if v is not None else 0.0 for v in (variable.start, variable.lower, variable.upper)
    )
    if start != variable.neutral and not lower <= start <= upper:
        raise InputError(
            f"machine {machine!r}: {variable.name}: found {start!r}, "
            f"expected a value from {lower:g} to {upper:g} [{variable.unit or '1'}]"
        )
    value = float(start) - (variable.kind in ENUMERATIONS)
    bits = struct.pack(">d", value).hex()
    return f"{variable.place} {bits} {variable.name} {value!r} {variable.unit or ''}".rstrip()


def _one_line(name: str) -> str:
    return " ".join(name.split()).encode()[:100].decode(errors="ignore")


def fnv1a(data: bytes) -> int:
    """The 64-bit FNV-1a hash."""
    total = OFFSET
    for byte in data:
        total = (total ^ byte) * PRIME & MASK
    return total
