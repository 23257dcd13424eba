"""The variable table as C: `fmi2_variables.h`, read by `fmu_src/native/slave.c`."""

from __future__ import annotations

import json
from collections.abc import Sequence

from corexy_fmi.fmu.variables import Variable
from corexy_fmi.kernel.generate import BANNER
from corexy_fmi.kernel.layout import Instance, Layout
from corexy_fmi.topologies import knows
from corexy_fmi.topology import STAGES

TYPES = {"Real": "REAL", "Integer": "INTEGER"}
DRIVES = ("stepper", "dc")
CLAIM = """\
/* effects: the parameter that switches one off, and the drives and fidelities that know it */
struct claim { const char *name; int parameter; double neutral; int drives, fidelities; };"""


def variables_header(table: Sequence[Variable], layout: Layout, guid: str) -> str:
    """The header's text."""
    first = next(i for i, v in enumerate(table) if v.role == "parameter")
    claims = [row for instance in layout.instances for row in _claims(table[first:], instance)]
    sizes = {"VARIABLE_COUNT": len(table), "FIRST_PARAMETER": first, "CLAIM_COUNT": len(claims)}
    return "\n".join(
        [
            BANNER,
            f"static const char INTERFACE[] = {json.dumps(guid)};",
            f"enum {{ {', '.join(f'{name} = {size}' for name, size in sizes.items())} }};",
            "static const struct variable VARIABLES[] = {",
            *map(_row, table),
            "};",
            CLAIM,
            "static const struct claim CLAIMS[] = {",
            *claims,
            "};",
            "",
        ]
    )


def _row(variable: Variable) -> str:
    lower = -float("inf") if variable.lower is None else variable.lower
    upper = float("inf") if variable.upper is None else variable.upper
    neutral = variable.neutral if variable.neutral is not None else (variable.lower or 0.0)
    kind = TYPES.get(variable.kind, "ENUMERATION")
    cells = [json.dumps(variable.name), json.dumps(variable.unit or ""), kind]
    cells += [variable.role.upper(), str(variable.place)]
    cells += [_number(value) for value in (lower, upper, neutral)]
    return f"    {{{', '.join(cells)}}},"


def _number(value: float) -> str:
    if value in (float("inf"), -float("inf")):
        return "HUGE_VAL" if value > 0 else "-HUGE_VAL"
    return repr(float(value))


def _claims(parameters: Sequence[Variable], instance: Instance) -> list[str]:
    """A row for each size; an idler's effect needs the fidelity that has idlers."""
    effect = instance.effect
    idler = instance.location.startswith("pulley")
    known = [
        f for f in STAGES if knows(f, effect, instance.location) and (f == "full" or not idler)
    ]
    drives = sum(1 << i for i, drive in enumerate(DRIVES) if drive in effect.drives)
    fidelities = sum(1 << i for i, fidelity in enumerate(STAGES) if fidelity in known)
    rows = []
    for k, p in enumerate(effect.parameters):
        if p.size:
            place = instance.parameter + k
            name = json.dumps(parameters[place].name)
            rows.append(f"    {{{name}, {place}, {p.neutral!r}, {drives}, {fidelities}}},")
    return rows
