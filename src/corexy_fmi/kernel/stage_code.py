"""Pieces of C that both the topologies' tables and their steps are written with."""

from __future__ import annotations

from collections.abc import Sequence

from corexy_fmi.topology import Section, Stage

FIRST_IDLER = 4  # place in q: x, y, two motors, then the idlers


def signed_sum(terms: Sequence[tuple[float, str]]) -> str:
    """A sum in the order of its terms; ``-a - b + c`` as ``c - (a + b)``: the same bits."""
    signs = [weight < 0 for weight, _ in terms]
    if signs[:3] == [True, True, False]:
        (a, first), (b, second), last, *others = terms
        both = f"({signed_sum([(-a, first), (-b, second)])})"
        return signed_sum([last, (-1, both), *others])
    text = ""
    for weight, name in terms:
        factor = name if abs(weight) == 1 else f"{abs(weight)!r} * {name}"
        sign = "-" if weight < 0 else "+"
        text += f" {sign} {factor}" if text else f"{'-' if weight < 0 else ''}{factor}"
    return text or "0.0"


def function(head: str, lines: Sequence[str], before: str = "", after: str = "") -> str:
    """A C function whose lines run for each lane."""
    body = "\n".join(f"        {line}" for line in lines)
    return f"static void {head}\n{{\n{before}    EACH {{\n{body}\n    }}\n{after}}}\n"


def of_stage(stage: Stage, name: str, lines: Sequence[str], after: str = "") -> str:
    return function(f"{stage.name}_{name}(stage *s)", lines, "    (void)s;\n", after)


def forces(stage: Stage, tension: str, arms: tuple[str, str]) -> list[str]:
    """Generalised force of the belts on each coordinate; arms are the motors' and the idlers'."""
    forces = []
    for i, coordinate in enumerate(stage.coordinates):
        neighbours = [(n, s) for n, s in enumerate(stage.sections) if coordinate in s.row]
        force = signed_sum([(-s.row[coordinate], tension.format(n)) for n, s in neighbours])
        arm = arms[i >= FIRST_IDLER].format(i - 2)
        forces.append(force if i < 2 else f"{arm} * ({force})")
    return forces


def section_sum(stage: Stage, section: Section) -> str:
    """Elongation of a section from the local variables of `find_forces`."""
    index = {c: i for i, c in enumerate(stage.coordinates)}
    name = {c: f"q{i}" if i < 2 else f"u{i}" for c, i in index.items()}
    return signed_sum([(w, name[c]) for c, w in section.row.items()])


def offsets(section: Section) -> list[tuple[float, str]]:
    """What play at the motors adds to the elongation."""
    motors = [c for c in ("phi1", "phi2") if c in section.row]
    return [(section.row[c], f"s->offset[{int(c[3:]) - 1}][l]") for c in motors]
