"""Idlers between belts that an effect damps much, as C: their rates are found implicitly.

A light idler on a belt damped by milliseconds settles within microseconds; extrapolated rates would
ask for steps as short.  With A = 2 J / h + d + C of the idlers, C the belts' dashpots between them:

    A w = 2 J v / h + Q - f                 speeds in the middle of the step, friction f as it was
    v' = 2 w - v - m (f' - f),  m = 2 |A|^-1 1,  f' within its bound, or 0 = v'

Where friction slides on this is the trapezoidal rule; a change of friction is met as if all that is
tied together would follow, so that it settles without overshoot in a few steps, and what sticks
sticks exactly.  Idlers are tied in chains: A is eliminated in order.

Where pulleys do not run true, what that adds to Q is taken from the last step first (`tie`), and
what it adds now is met behind it (`kick_tied`).  Where a law bends the tensions rates stay
extrapolated: what goes slack is no dashpot, and as if it were, the motion was off by 45 um.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from corexy_fmi.kernel.stage_code import (
    FIRST_IDLER,
    forces,
    function,
    of_stage,
    offsets,
    signed_sum,
)
from corexy_fmi.topology import Section, Stage


def idlers(stage: Stage) -> range:
    """Places in q."""
    return range(FIRST_IDLER, len(stage.coordinates))


def damped_lines(stage: Stage) -> list[str]:
    """From elastic tensions ``tension0`` .. to those with damping, and the idlers' kick."""
    return [
        *_dashpots(stage),
        *_known_rates(stage),
        *_equations(stage),
        *_forced(stage, "f{i} - s->friction[{i}][l]"),
        *_solved(stage),
        *(line for i in idlers(stage) for line in _kicked(i)),
        *_rates(stage, {i: f"0.5 * r * (old{i} + v{i})" for i in idlers(stage)}),
    ]


def tie(stage: Stage) -> str:
    """Rates of elongation in the middle of the step, before laws act on the tensions; the idlers'
    speeds there, and the forces without such laws.
    """
    lines = ["const double r = s->radius[0][l];", "(void)r;"]
    for n, section in enumerate(stage.sections):
        elongation = [(1.0, f"s->elongation[{n}][l]"), *offsets(section)]
        lines += [f"double tension{n} = s->stiffness[{n}][l] * ({signed_sum(elongation)});"]
    lines += [*_dashpots(stage), *_known_rates(stage), *_equations(stage)]
    lines += _forced(stage, "f{i} + s->lawful[{i}][l] - s->friction[{i}][l]") + _solved(stage)
    speeds = {
        i: f"r * w{i}" if i >= FIRST_IDLER else f"w{i}" for i in range(len(stage.coordinates))
    }
    for n, section in enumerate(stage.sections):
        terms = [
            (w, speeds[i]) for i, c in enumerate(stage.coordinates) if (w := section.row.get(c))
        ]
        lines += [f"s->rate[{n}][l] = pick(damps, {signed_sum(terms)}, s->rate[{n}][l]);"]
    lines += _rates(stage, {i: speeds[i] for i in idlers(stage)})
    found = forces(stage, "tension{}", ("s->gain[{}][l]", "r"))
    for i in idlers(stage):
        lines += [f"s->even[{i}][l] = w{i};", f"s->lawless[{i}][l] = {found[i]};"]
    return of_stage(stage, "tie", lines if idlers(stage) else [])


def kick_tied(stage: Stage) -> str:
    """The idlers' kick behind the laws."""
    lines = ["const double half = 0.5 * s->step, r = s->radius[0][l];", "(void)r; (void)half;"]
    lines += [*_dashpots(stage), *_equations(stage, known=False)]
    for i in idlers(stage):
        lines += [
            f"const double lawful{i} = s->force[{i}][l] - s->lawless[{i}][l];",
            f"const double f{i} = s->force[{i}][l];",
        ]
    lines += _forced(stage, "lawful{i} - s->lawful[{i}][l]", moving=False) + _solved(stage, "more")
    for i in idlers(stage):
        lines += [f"const double w{i} = s->even[{i}][l] + more{i};", *_kicked(i)]
        lines += [f"s->lawful[{i}][l] = pick(damps, lawful{i}, 0.0);"]
    return by_smoothness(f"{stage.name}_kick_tied", lines if idlers(stage) else [])


def by_smoothness(name: str, lines: Sequence[str], before: str = "") -> str:
    """A C function of a stage, compiled for set-valued and for smooth friction."""
    first = f"    {before} (void)s; (void)smooth;{' (void)bent;' * bool(before)}\n"
    inner = function(f"{name}_as(stage *s, const int smooth)", lines, first)
    return inner.replace("static void", "INLINE void") + (
        f"static void {name}(stage *s)\n{{\n    if (s->smooth) {name}_as(s, 1);\n"
        f"    else {name}_as(s, 0);\n}}\n"
    )


def _dashpots(stage: Stage) -> list[str]:
    names = [f"c{n}" for n in range(len(stage.sections))]
    lines = [
        f"const double {c} = s->stiffness[{n}][l] * s->belt_time[{n}][l];"
        for n, c in enumerate(names)
    ]
    return [*lines, "const int damps = s->tied[0][l] > 0; (void)damps;"]


def _known_rates(stage: Stage) -> list[str]:
    """What all but the idlers add to the rates of elongation in the middle of the step."""
    lines = [f"const double w{i} = middle_velocity(s, {i}, l); (void)w{i};" for i in (0, 1)]
    for m, i in ((0, 2), (1, 3)):
        free = f"pick(s->released[{m}][l] > 0, middle_velocity(s, {i}, l), s->v[{i}][l])"
        lines += [f"const double w{i} = s->gain[{m}][l] * ({free}); (void)w{i};"]
    return lines + _rates(stage, {i: f"w{i}" for i in range(FIRST_IDLER)})


def _rates(stage: Stage, speeds: dict[int, str]) -> list[str]:
    """Damping by the speeds of some coordinates."""
    names, lines = {stage.coordinates[i]: speed for i, speed in speeds.items()}, []
    for n, section in enumerate(stage.sections):
        terms = [(w, names[c]) for c, w in section.row.items() if c in names]
        if terms:
            lines += [f"tension{n} += c{n} * ({signed_sum(terms)});"]
    return lines


def _equations(stage: Stage, known: bool = True) -> list[str]:
    """The diagonal; ``known``: and the forces at the speeds that are known."""
    lines, found = [], forces(stage, "tension{}", ("s->gain[{}][l]", "r"))
    for i in idlers(stage):
        touching = [f"c{n}" for n, s in enumerate(stage.sections) if stage.coordinates[i] in s.row]
        lines += [
            f"const double old{i} = s->v[{i}][l];",
            f"const double inert{i} = 2.0 * s->mass[{i}][l] / s->step;",
            f"double a{i} = inert{i} + s->damping0[{i}][l] + r * r * ({' + '.join(touching)});",
        ]
        lines += [f"const double f{i} = {found[i]};"] if known else []
    return lines


def _forced(stage: Stage, force: str, moving: bool = True) -> list[str]:
    """Right-hand sides, of the speeds and of what follows a change of friction."""
    inert = "inert{i} * old{i} + " if moving else ""
    return [
        f"double b{i} = {inert.format(i=i)}{force.format(i=i)}, o{i} = 1.0;" for i in idlers(stage)
    ]


def _ties(stage: Stage) -> dict[tuple[int, int], str]:
    """Elements of A beside its diagonal."""
    return {
        (i, j): f"r * r * ({signed_sum(both)})"
        for i, j in combinations(idlers(stage), 2)
        if (both := _shared(stage.sections, stage.coordinates[i], stage.coordinates[j]))
    }


def _shared(sections: Sequence[Section], one: str, two: str) -> list[tuple[float, str]]:
    return [
        (s.row[one] * s.row[two], f"c{n}")
        for n, s in enumerate(sections)
        if {one, two} <= set(s.row)
    ]


def _solved(stage: Stage, name: str = "w") -> list[str]:
    """Elimination in order, then the speeds and the mobilities ``m``, last ones first."""
    ties, lines = _ties(stage), []
    lines += [f"double g{i}_{j} = {value};" for (i, j), value in ties.items()]
    behind = {i: [j for j in idlers(stage) if (i, j) in ties] for i in idlers(stage)}
    for i, others in behind.items():
        lines += [f"const double share{i} = 1.0 / a{i};"]
        for j in others:
            part = f"part{i}_{j}"
            lines += [
                f"const double {part} = g{i}_{j} * share{i};",
                f"a{j} -= {part} * g{i}_{j}, b{j} -= {part} * b{i}, o{j} += fabs({part}) * o{i};",
            ]
        if len(others) > 1:
            raise ValueError(f"{stage.name}: idlers {others} hang on {i}, out of a chain's order")
    for i in reversed(idlers(stage)):
        known = "".join(f" - g{i}_{j} * {name}{j}" for j in behind[i])
        follow = "".join(f" + fabs(g{i}_{j}) * m{j}" for j in behind[i])
        lines += [f"const double {name}{i} = (b{i}{known}) * share{i};"]
        lines += [f"const double m{i} = (o{i}{follow}) * share{i}; (void)m{i};"]
    return lines


def _kicked(i: int) -> list[str]:
    """The kick of an idler; as ever in a lane that is not tied."""
    return [
        f"const double next{i} = 2.0 * w{i} - old{i}, give{i} = 2.0 * m{i};",
        f"const double most{i} = give{i} * s->bound0[{i}][l];",
        f"const double fast{i} = next{i} + give{i} * s->friction[{i}][l];",
        f"const double held{i} = smooth ? slide(fast{i}, most{i}, rounded(most{i}, "
        f"s->smoothing[{i}][l])) : stop(fast{i}, most{i});",
        f"const double plain{i} = kicked_free(s, {i}, l, old{i}, f{i}, smooth);",
        f"const double v{i} = pick(damps, held{i}, plain{i});",
        f"const double turned{i} = s->friction[{i}][l] + (next{i} - held{i}) / give{i};",
        f"s->friction[{i}][l] = pick(damps, turned{i}, 0.0);",
        f"s->before[{i}][l] = old{i};",
        f"s->v[{i}][l] = v{i};",
        f"s->q[{i}][l] = drifted(s->q[{i}][l], v{i}, half);",
    ]
