"""Steps that no hook interrupts as C: the rows of a sweep, their state in registers."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from corexy_fmi.kernel.pair_code import advance_pairs, mirrored
from corexy_fmi.kernel.stage_code import FIRST_IDLER, forces, section_sum
from corexy_fmi.topology import Stage

ADVANCE = """\
static void {name}(stage *s, sweep *w)
{{
    {load}
    int more;
    do {{
        const interval *const at = &w->part[w->turn];
        more = begin_interval(s, w);
        const wide half = spread(0.5 * at->step);
        double time = at->start;
        {drift}
        for (int64_t n = 1;; n++) {{
            const double end = end_of_step(at, n), now = 0.5 * (time + end);
            {hold}
            FENCE;
            {tensions}
            if (n >= at->count) {{
                {kept}
            }}
            FENCE;
            {kick}
            if (n >= at->count) break;
            time = end;
            {on}
        }}
        {store}
        reach_row(w);
    }} while (more);
    {leave}
}}
"""


def advance(stage: Stage) -> str:
    """All micro-steps of the rows of a sweep in registers, where no hook runs.

    The same operations in the same order as `move` of stage.c; the last step of a row also keeps
    what may be asked for behind it, and leaves the motors and the clock to `run_rows`.  Constants
    are read in every step, and positions lie in memory while forces are found: in registers they
    would push out what the next operations wait for.
    """
    if stage.sections and mirrored(stage):
        return f"#if PAIRS\n{advance_pairs(stage)}#else\n{_advance(stage, _stopped)}#endif\n"
    return _advance(stage, _stopped)


def advance_smooth(stage: Stage) -> str:
    """The same where Coulomb friction rises with a small speed in any lane."""
    return _advance(stage, _slid)


def advance_dc(stage: Stage) -> str:
    """The same of rotors that a torque turns, even over a row."""
    return _advance(stage, _stopped, dc=True)


def advance_dc_smooth(stage: Stage) -> str:
    """Both."""
    return _advance(stage, _slid, dc=True)


def _advance(stage: Stage, left: Callable[[int, str], str], dc: bool = False) -> str:
    """``left``: what friction leaves of a coordinate's speed; ``dc``: no motor is imposed."""
    name = f"{stage.name}_advance{'_dc' if dc else ''}{'_smooth' if left is _slid else ''}"
    if not stage.sections or (dc and any(stage.direct)):
        return f"static void {name}(stage *s, sweep *w)\n{{\n    (void)s; (void)w;\n}}\n"
    free = [i for i in range(len(stage.coordinates)) if dc or i not in (2, 3)]
    found = forces(stage, "tension{}", ("r", "r"))
    if dc:
        found[2:4] = [f"({found[i]}) + WIDE(s->torque[{i - 2}])" for i in (2, 3)]
    store = {i: f"WIDE(s->q[{i}]) = q{i}, WIDE(s->v[{i}]) = v{i};" for i in free}
    return ADVANCE.format(
        name=name,
        load="\n    ".join(f"wide q{i} = WIDE(s->q[{i}]), v{i} = WIDE(s->v[{i}]);" for i in free),
        drift="\n        ".join(f"q{i} = q{i} + half * v{i};" for i in free),
        hold="\n            ".join(f"WIDE(s->q[{i}]) = q{i};" for i in free),
        tensions="\n            ".join(_tensions(stage, free)),
        kept="\n                ".join(_kept(stage, free, found)),
        kick="\n            ".join(_kick(free, found, left)),
        on="\n            ".join(f"q{i} = q{i} + d{i};" for i in free),
        store="\n        ".join(store[i] for i in free if i < FIRST_IDLER),
        leave="\n    ".join(store.values()),
    )


def _tensions(stage: Stage, free: Sequence[int]) -> list[str]:
    lines = ["const wide r = WIDE(s->radius[0]);", "(void)r; (void)now;"]
    for m, i in ((m, i) for m, i in ((0, 2), (1, 3)) if i not in free):
        angle = f"WIDE(at->angle[{m}]) + WIDE(at->rate[{m}]) * spread(now - at->since)"
        lines += [f"const wide q{i} = {angle};"]
    lines += [f"const wide u{i} = r * q{i}; (void)u{i};" for i in range(2, len(stage.coordinates))]
    for n, section in enumerate(stage.sections):
        elongation = section_sum(stage, section)
        lines += [f"const wide tension{n} = WIDE(s->stiffness[{n}]) * ({elongation});"]
    return lines


def _kept(stage: Stage, free: Sequence[int], found: Sequence[str]) -> list[str]:
    lines = [f"WIDE(s->tension[{n}]) = tension{n};" for n in range(len(stage.sections))]
    lines += [f"WIDE(s->force[{i}]) = {force};" for i, force in enumerate(found[:FIRST_IDLER])]
    return lines + [f"WIDE(s->before[{i}]) = v{i};" for i in free if i < FIRST_IDLER]


def _stopped(i: int, fast: str) -> str:
    return f"halt({fast}, WIDE(s->slip[{i}]))"


def _slid(i: int, fast: str) -> str:
    places = ("gain[0]", "gain[1]", "lift[0]", "gain[2]", "lift[1]")
    rounding = ", ".join(f"WIDE(s->round_{place}[{i}])" for place in places)
    return f"slid({fast}, WIDE(s->slip[{i}]), {rounding})"


def _kick(free: Sequence[int], found: Sequence[str], left: Callable[[int, str], str]) -> list[str]:
    lines = []
    for i in free:
        kick = f"WIDE(s->keep[{i}]) * v{i} + WIDE(s->push[{i}]) * ({found[i]})"
        lines += [f"v{i} = {left(i, kick)};", f"const wide d{i} = half * v{i};"]
        lines += [f"q{i} = WIDE(s->q[{i}]) + d{i};"]
    return lines
