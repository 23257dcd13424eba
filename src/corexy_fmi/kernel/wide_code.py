"""Steps that no hook interrupts as C: the rows of a sweep, their state in registers."""

from __future__ import annotations

from collections.abc import Sequence

from corexy_fmi.kernel.pair_code import advance_pairs, mirrored
from corexy_fmi.kernel.stage_code import FIRST_IDLER, forces, section_sum
from corexy_fmi.topology import Stage

ADVANCE = """\
static void {name}_advance(stage *s, sweep *w)
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
    if not stage.sections:
        return (
            f"static void {stage.name}_advance(stage *s, sweep *w)\n{{\n    (void)s; (void)w;\n}}\n"
        )
    if mirrored(stage):
        return f"#if PAIRS\n{advance_pairs(stage)}#else\n{_advance_wide(stage)}#endif\n"
    return _advance_wide(stage)


def _advance_wide(stage: Stage) -> str:
    free = [i for i in range(len(stage.coordinates)) if i not in (2, 3)]
    store = {i: f"WIDE(s->q[{i}]) = q{i}, WIDE(s->v[{i}]) = v{i};" for i in free}
    return ADVANCE.format(
        name=stage.name,
        load="\n    ".join(f"wide q{i} = WIDE(s->q[{i}]), v{i} = WIDE(s->v[{i}]);" for i in free),
        drift="\n        ".join(f"q{i} = q{i} + half * v{i};" for i in free),
        hold="\n            ".join(f"WIDE(s->q[{i}]) = q{i};" for i in free),
        tensions="\n            ".join(_tensions(stage)),
        kept="\n                ".join(_kept(stage)),
        kick="\n            ".join(_kick(stage, free)),
        on="\n            ".join(f"q{i} = q{i} + d{i};" for i in free),
        store="\n        ".join(store[i] for i in free if i < 2),
        leave="\n    ".join(store.values()),
    )


def _tensions(stage: Stage) -> list[str]:
    lines = ["const wide r = WIDE(s->radius[0]);", "(void)r;"]
    for m, i in ((0, 2), (1, 3)):
        angle = f"WIDE(at->angle[{m}]) + WIDE(at->rate[{m}]) * spread(now - at->since)"
        lines += [f"const wide q{i} = {angle};"]
    lines += [f"const wide u{i} = r * q{i}; (void)u{i};" for i in range(2, len(stage.coordinates))]
    for n, section in enumerate(stage.sections):
        elongation = section_sum(stage, section)
        lines += [f"const wide tension{n} = WIDE(s->stiffness[{n}]) * ({elongation});"]
    return lines


def _kept(stage: Stage) -> list[str]:
    found = forces(stage, "tension{}", ("r", "r"))[:FIRST_IDLER]
    lines = [f"WIDE(s->tension[{n}]) = tension{n};" for n in range(len(stage.sections))]
    lines += [f"WIDE(s->force[{i}]) = {force};" for i, force in enumerate(found)]
    return lines + [f"WIDE(s->before[{i}]) = v{i};" for i in range(2)]


def _kick(stage: Stage, free: Sequence[int]) -> list[str]:
    lines, found = [], forces(stage, "tension{}", ("r", "r"))
    for i in free:
        kick = f"WIDE(s->keep[{i}]) * v{i} + WIDE(s->push[{i}]) * ({found[i]})"
        lines += [f"v{i} = halt({kick}, WIDE(s->slip[{i}]));", f"const wide d{i} = half * v{i};"]
        lines += [f"q{i} = WIDE(s->q[{i}]) + d{i};"]
    return lines
