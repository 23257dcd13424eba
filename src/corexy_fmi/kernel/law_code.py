"""One law of an effect as a C function over lanes."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from sympy.printing.c import C99CodePrinter

from corexy_fmi.effects.api import Effect, Law
from corexy_fmi.errors import InputError
from corexy_fmi.kernel.ports import COMMON, HOST, OBSERVERS, PORTS
from corexy_fmi.kernel.trace import argument_names, c_statements, hoisted, symbols
from corexy_fmi.nearest import nearest

HELD, ONCE = "h_", "once_"  # prefixes of what is found once for a run, for all places of a step
ARGUMENTS = "stage *s, int p, int m, int h, int between, int i, int end"  # of a law in C
PLAIN_ARRAYS = ("belt_sign", "side", "yaw_arm")  # the same for all lanes
RESERVED = {
    "s",
    "p",
    "m",
    "h",
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
    where = f"{effect.name}: {law.function.__name__}"
    raise InputError(f"{where} reads {name}, known are {known}{nearest(name, known)}")


def _target(effect: Effect, law: Law, name: str) -> str:
    """Where a law's result goes, as C."""
    where = f"{effect.name}: {law.function.__name__}"
    if name in effect.memory:
        if law.port in OBSERVERS:
            raise InputError(f"{where} may not remember {name} at {law.port}, which only looks")
        return f"s->memory[m + {effect.memory.index(name)}][l]"
    if name not in PORTS[law.port].writes:
        raise InputError(f"{where} may not write {name} at {law.port}")
    return _lvalue(law.port, name)


def written(effect: Effect, law: Law) -> set[str]:
    """Arrays of the stage's state that a law changes."""
    results = law.function(**symbols(argument_names(law.function)))
    return {PORTS[law.port].variables[n][0] for n in results if n not in effect.memory}


def touched(effect: Effect, law: Law) -> set[str]:
    """Arrays of the stage's state that a law reads or changes."""
    known = PORTS[law.port].variables
    read = {known[n][0] for n in argument_names(law.function) if n in known}
    return read | written(effect, law)


def check_names(effect: Effect) -> None:
    """Names of memory and parameters become C variables beside the ports' and the generator's own.

    Raises InputError for one that cannot.
    """
    taken = RESERVED.union(*(PORTS[law.port].variables for law in effect.laws))
    for name in (*effect.memory, *(p.name for p in effect.parameters)):
        if name in taken or not name.isidentifier() or name.startswith(("t_", HELD, ONCE)):
            raise InputError(f"{effect.name}: the name {name!r} is taken, choose another")


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


@dataclass(frozen=True)
class Parts:
    """A law's results, and what of them is found once: by its parameters and the length of the
    step for a whole run, ``held``; by these and the time for all places of a step, ``once``.
    """

    results: dict[str, Any]
    held: dict[str, Any]
    once: dict[str, Any]


def parts_of(effect: Effect, law: Law) -> Parts:
    """A law in its parts; raises InputError where its names are taken."""
    check_names(effect)
    known = {p.name for p in effect.parameters}
    given = law.function(**symbols(argument_names(law.function)))
    results, held = hoisted(given, known | {"step"}, HELD)
    if max(map(len, effect.locations.values())) == 1:
        return Parts(results, held, {})
    results, once = hoisted(results, known | set(COMMON) | set(held), ONCE)
    return Parts(results, held, once)


def law_code(effect: Effect, law: Law, index: int) -> str:
    """One law as a C function over its places, and one that finds what it holds for a run; a lane
    in which it is off keeps its values.
    """
    names, parts = argument_names(law.function), parts_of(effect, law)
    lines, results = c_statements(parts.results)
    body = [f"const int on = {on_expression(effect, 'p')};"]
    body += _read(effect, law, names, parts, [*lines, *results.values()])
    body += [f"const double {n} = {n}_lanes[l];" for n in parts.once]
    body += lines
    body += [f"const double {n}_new = {value};" for n, value in results.items()]
    targets = {n: _target(effect, law, n) for n in results}
    body += [f"{target} = pick(on, {n}_new, {target});" for n, target in targets.items()]
    code = "\n".join(f"        {line}" for line in body)
    return (
        f"/* {effect.summary} [{effect.citation}] */\n"
        f"static void {effect.name}_{index}({ARGUMENTS})\n"
        f"{{\n    (void)p; (void)h;\n{_once(effect, law, names, parts)}"
        f"    for (; i < end; i++, m += between)\n    EACH {{\n{code}\n    }}\n}}\n"
        f"{_hold(effect, law, index, names, parts)}"
    )


def _read(effect: Effect, law: Law, names: list[str], parts: Parts, lines: list[str]) -> list[str]:
    """The arguments and held parts that some lines of C name, as constants."""
    used = set(re.findall(r"\w+", " ".join(lines)))
    where = {n: _argument(effect, law, n) for n in names if n in used}
    where |= {n: f"s->held[h + {k}][l]" for k, n in enumerate(parts.held) if n in used}
    return [f"const double {n} = {place};" for n, place in where.items()]


def _once(effect: Effect, law: Law, names: list[str], parts: Parts) -> str:
    """What all places share, as C in front of their loop."""
    if not parts.once:
        return ""
    lines, results = c_statements(parts.once)
    body = _read(effect, law, names, parts, [*lines, *results.values()])
    body += [*lines, *(f"{n}_lanes[l] = {value};" for n, value in results.items())]
    arrays = ", ".join(f"{n}_lanes[LANES]" for n in parts.once)
    code = "\n".join(f"        {line}" for line in body)
    return f"    double {arrays};\n    EACH {{\n{code}\n    }}\n"


def _hold(effect: Effect, law: Law, index: int, names: list[str], parts: Parts) -> str:
    """What holds for a run, as a C function; nothing where nothing does."""
    if not parts.held:
        return ""
    lines, results = c_statements(parts.held)
    body = _read(effect, law, names, parts, [*lines, *results.values()])
    body += [*lines, *(f"s->held[h + {k}][l] = {v};" for k, v in enumerate(results.values()))]
    code = "\n".join(f"        {line}" for line in body)
    head = f"static void {effect.name}_{index}_hold(stage *s, int p, int h)"
    return f"{head}\n{{\n    EACH {{\n{code}\n    }}\n}}\n"


def check_laws(effect: Effect) -> None:
    """Trace every law of a user's own effect: raises InputError for one that cannot be."""
    for law in effect.laws:
        if law.port not in PORTS:
            where, known = f"{effect.name}: {law.function.__name__}", ", ".join(PORTS)
            near = nearest(law.port, PORTS)
            raise InputError(f"{where}: unknown port {law.port!r}, expected one of {known}{near}")
    traced = [(k, law) for k, law in enumerate(effect.laws) if law.port not in HOST]
    for index, law in traced:
        try:
            law_code(effect, law, index)
        except InputError:
            raise
        except Exception as error:  # whatever a user's own code raises
            where = f"{effect.name}: {law.function.__name__}"
            told = f"{type(error).__name__}: {error}"
            raise InputError(f"{where} cannot be traced: {told}") from error
