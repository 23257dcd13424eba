"""Micro-steps of one lane whose two belts mirror each other: both at once, in registers of two.

Belt 2 of the full stage is belt 1 over again: its k-th section has the same row with all signs
turned but that of y.  So with belt 2's tensions counted negative one formula holds for both, a
register holding belt 1's value and belt 2's.  Every sum has the terms and the order that it has in
`wide_code`, so that the bits are the same; x and -y share a register, because belt 1 pulls at x as
it pulls at -y.
"""

from __future__ import annotations

from corexy_fmi.kernel.stage_code import FIRST_IDLER, forces, signed_sum
from corexy_fmi.topology import Section, Stage

Pair = tuple[int, int]  # places in q: belt 1's, belt 2's
KICK = ("keep", "push", "slip")
ADVANCE = """\
static void {name}_advance(stage *s, sweep *w)
{{
    const pair r = twice(s->radius[0][0]);
    struct {{ pair {constants}; }} c;
    {load}
    q0 = turned(q0, 0.0, -0.0), v0 = turned(v0, 0.0, -0.0);
    pair before, {kept};
    int more;
    do {{
        const interval *const at = &w->part[w->turn];
        more = begin_interval(s, w);
        const pair half = twice(0.5 * at->step);
        double time = at->start;
        {drift}
        for (int64_t n = 1;; n++) {{
            const double end = end_of_step(at, n), now = 0.5 * (time + end);
            const pair angle = next_to(at->angle[0]), rate = next_to(at->rate[0]);
            const pair x = low(q0, q0), y = turned(high(q0, q0), -0.0, 0.0);
            const pair u2 = r * (angle + rate * twice(now - at->since));
            {tensions}
            before = v0;
            {kick}
            if (n >= at->count) break;
            time = end;
            {on}
        }}
        beside(negated(q0), s->q[0]), beside(negated(v0), s->v[0]);
        reach_row(w);
    }} while (more);
    beside(negated(before), s->before[0]);
    {store}
}}
"""


def mirrored(stage: Stage) -> bool:
    """Whether belt 2 repeats belt 1, with idlers and a motor of its own."""
    one, two = _belts(stage)
    pulls = [[s.row[axis] for s in one if axis in s.row] for axis in "xy"]
    if len(one) != len(two) or pulls != [[1, -1], [1, -1]]:
        return False
    index = {c: i for i, c in enumerate(stage.coordinates)}
    found = {
        (index[c], index[d], w == -v)
        for a, b in zip(one, two, strict=True)
        for (c, w), (d, v) in zip(a.row.items(), b.row.items(), strict=True)
    }
    own = {(a, b, True) for a, b in dict(_pairs(stage)).items()}
    return found == {(0, 0, True), (1, 1, False), *own}


def _belts(stage: Stage) -> tuple[list[Section], list[Section]]:
    one, two = ([s for s in stage.sections if s.belt == belt] for belt in (1, 2))
    return one, two


def _pairs(stage: Stage) -> list[Pair]:
    """Motors, then idlers, of belt 1 with their likes of belt 2."""
    index = {c: i for i, c in enumerate(stage.coordinates)}
    rows = zip(*_belts(stage), strict=True)
    pairs = [p for a, b in rows for p in zip(a.row, b.row, strict=True) if p[0] not in "xy"]
    return sorted({(index[c], index[d]) for c, d in pairs})


def advance_pairs(stage: Stage) -> str:
    """`advance` of `wide_code` in pairs: the same operations in the same order."""
    half = len(_belts(stage)[0])
    idlers = [pair for pair in _pairs(stage) if pair[0] >= FIRST_IDLER]
    moved = [(0, 1), *idlers]
    constants = [f"{name}{a}" for name in KICK for a, _ in moved]
    return ADVANCE.format(
        name=stage.name,
        constants=", ".join([*constants, *(f"k{n}" for n in range(half))]),
        load="\n    ".join(_load(moved, half)),
        kept=", ".join(f"last{n}" for n in range(half)),
        drift="\n        ".join(f"q{a} = q{a} + half * v{a};" for a, _ in moved),
        tensions="\n            ".join(_tensions(stage, idlers)),
        kick="\n            ".join(_kick(stage, idlers)),
        on="\n            ".join(f"q{a} = q{a} + d{a};" for a, _ in moved),
        store="\n    ".join(_store(stage, idlers, half)),
    )


def _load(moved: list[Pair], half: int) -> list[str]:
    lines = [f"c.{n}{a} = both(s->{n}[{a}], s->{n}[{b}]);" for n in KICK for a, b in moved]
    lines += [f"c.k{n} = both(s->stiffness[{n}], s->stiffness[{n + half}]);" for n in range(half)]
    for name in "qv":
        lines += [f"pair {name}{a} = both(s->{name}[{a}], s->{name}[{b}]);" for a, b in moved]
    return lines


def _tensions(stage: Stage, idlers: list[Pair]) -> list[str]:
    """Belt 1's, and belt 2's negative."""
    lines = [f"const pair u{a} = r * q{a};" for a, _ in idlers]
    name = {c: c if c in "xy" else f"u{i}" for i, c in enumerate(stage.coordinates)}
    for n, section in enumerate(_belts(stage)[0]):
        elongation = signed_sum([(w, name[c]) for c, w in section.row.items()])
        lines += [f"const pair t{n} = c.k{n} * ({elongation});", f"last{n} = t{n};"]
    return lines


def _kick(stage: Stage, idlers: list[Pair]) -> list[str]:
    """What the belts pull at x and -y (belt 1, then belt 2) and at idlers; what follows."""
    one, _ = _belts(stage)
    (a, b), (c, d) = ([n for n, s in enumerate(one) if axis in s.row] for axis in "xy")
    pull = f"low(t{b}, t{c}) - low(t{a}, t{d}) - high(t{a}, t{c}) + high(t{b}, t{d})"
    pulls = {0: pull}
    for i, _ in idlers:
        row = stage.coordinates[i]
        terms = [(-s.row[row], f"t{n}") for n, s in enumerate(one) if row in s.row]
        pulls[i] = f"r * ({signed_sum(terms)})"
    lines = []
    for i, force in pulls.items():
        lines += [f"v{i} = halt_pair(c.keep{i} * v{i} + c.push{i} * ({force}), c.slip{i});"]
        lines += [f"const pair d{i} = half * v{i};", f"q{i} = q{i} + d{i};"]
    return lines


def _store(stage: Stage, idlers: list[Pair], half: int) -> list[str]:
    """What may be asked for behind the last step, as `advance` leaves it."""
    lines = [f"part({n}{a}, s->{n}[{a}], s->{n}[{b}]);" for n in "qv" for a, b in idlers]
    for n in range(half):
        lines += [f"part(negated(last{n}), s->tension[{n}], s->tension[{n + half}]);"]
    lines += ["const double radius = s->radius[0][0];"]
    found = forces(stage, "s->tension[{}][0]", ("radius", "radius"))[:FIRST_IDLER]
    return lines + [f"s->force[{i}][0] = {force};" for i, force in enumerate(found)]
