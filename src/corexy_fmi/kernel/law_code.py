"""One law of an effect as a C function over lanes."""

from __future__ import annotations

import re
from typing import Any

from sympy.printing.c import C99CodePrinter

from corexy_fmi.effects.api import Effect, Law
from corexy_fmi.kernel.ports import COMMON, OBSERVERS, PORTS
from corexy_fmi.kernel.trace import argument_names, c_statements, hoisted, symbols

PLAIN_ARRAYS = ("belt_sign", "side", "yaw_arm")  # the same for all lanes
RESERVED = {
    "s",
    "p",
    "m",
    "i",
    "l",
    "on",
    "between",
    "end",
    *COMMON,
    *C99CodePrinter.reserved_words,
}


def _lvalue(port: str, name: str) -> str:
    array, index = PORTS[port].variables[name]
    return f"s->{array}[{index}]" + ("" if array in PLAIN_ARRAYS else "[l]")


def _argument(effect: Effect, law: Law, name: str) -> str:
    """Where a law's argument comes from, as C."""
    if name in PORTS[law.port].variables:
        return _lvalue(law.port, name)
    if name in COMMON:
        return f"s->{COMMON[name]}"
    if name in effect.memory:
        return f"s->memory[m + {effect.memory.index(name)}][l]"
    names = [p.name for p in effect.parameters]
    if name in names:
        return f"s->parameter[p + {names.index(name)}][l]"
    known = [*PORTS[law.port].variables, *COMMON, *effect.memory, *names]
    raise ValueError(f"{effect.name}: {law.function.__name__} reads {name}, known are {known}")


def _target(effect: Effect, law: Law, name: str) -> str:
    """Where a law's result goes, as C."""
    where = f"{effect.name}: {law.function.__name__}"
    if name in effect.memory:
        if law.port in OBSERVERS:
            raise ValueError(f"{where} may not remember {name} at {law.port}, which only looks")
        return f"s->memory[m + {effect.memory.index(name)}][l]"
    if name not in PORTS[law.port].writes:
        raise ValueError(f"{where} may not write {name} at {law.port}")
    return _lvalue(law.port, name)


def written(effect: Effect, law: Law) -> set[str]:
    """Arrays of the stage's state that a law changes."""
    results = law.function(**symbols(argument_names(law.function)))
    return {PORTS[law.port].variables[n][0] for n in results if n not in effect.memory}


def check_names(effect: Effect) -> None:
    """Names of memory and parameters become C variables beside the ports' and the generator's own.

    Raises ValueError for one that cannot.
    """
    taken = RESERVED.union(*(PORTS[law.port].variables for law in effect.laws))
    for name in (*effect.memory, *(p.name for p in effect.parameters)):
        if name in taken or not name.isidentifier() or name.startswith(("t_", "h_", "held_h_")):
            raise ValueError(f"{effect.name}: the name {name!r} is taken, choose another")


def on_expression(effect: Effect, first: str) -> str:
    """Whether the effect is on, as C; ``first`` is the place of its first parameter."""
    return " || ".join(
        f"s->parameter[{first} + {k}][l] != {p.neutral!r}"
        for k, p in enumerate(effect.parameters)
        if p.size
    )


def on_code(effect: Effect) -> str:
    """The same as a C function of the place of the effect's first parameter."""
    head = f"static int {effect.name}_on(const stage *s, int p, int l)"
    return f"{head} {{ return {on_expression(effect, 'p')}; }}\n"


def law_code(effect: Effect, law: Law, index: int) -> str:
    """One law as a C function over its places; a lane in which it is off keeps its values.

    What its parameters alone decide is found once for all places.
    """
    check_names(effect)
    names = argument_names(law.function)
    several = max(map(len, effect.locations.values())) > 1
    fixed = {p.name for p in effect.parameters} | set(COMMON) if several else set()
    result, parts = hoisted(law.function(**symbols(names)), fixed)
    once = _once(effect, law, names, parts)
    lines, results = c_statements(result)
    body = [f"const int on = {on_expression(effect, 'p')};"]
    body += _read(effect, law, names, [*lines, *results.values()])
    body += [f"const double {n} = held_{n}[l];" for n in parts]
    body += lines
    body += [f"const double {n}_new = {value};" for n, value in results.items()]
    targets = {n: _target(effect, law, n) for n in results}
    body += [f"{target} = pick(on, {n}_new, {target});" for n, target in targets.items()]
    code = "\n".join(f"        {line}" for line in body)
    return (
        f"/* {effect.summary} [{effect.citation}] */\n"
        f"static void {effect.name}_{index}(stage *s, int p, int m, int between, int i, int end)\n"
        f"{{\n    (void)p;\n{once}    for (; i < end; i++, m += between)\n"
        f"    EACH {{\n{code}\n    }}\n}}\n"
    )


def _read(effect: Effect, law: Law, names: list[str], lines: list[str]) -> list[str]:
    """The arguments that some lines of C name, as constants."""
    used = set(re.findall(r"\w+", " ".join(lines)))
    return [f"const double {n} = {_argument(effect, law, n)};" for n in names if n in used]


def _once(effect: Effect, law: Law, names: list[str], parts: dict[str, Any]) -> str:
    """What all places share, as C in front of their loop."""
    if not parts:
        return ""
    lines, results = c_statements(parts)
    body = _read(effect, law, names, [*lines, *results.values()])
    body += [*lines, *(f"held_{n}[l] = {value};" for n, value in results.items())]
    arrays = ", ".join(f"held_{n}[LANES]" for n in parts)
    code = "\n".join(f"        {line}" for line in body)
    return f"    double {arrays};\n    EACH {{\n{code}\n    }}\n"
