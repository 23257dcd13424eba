"""A topology's part of a micro-step as C: at once, or between the hooks of a belt."""

from __future__ import annotations

from collections.abc import Callable

from corexy_fmi.kernel.damped_code import by_smoothness, damped_lines, idlers
from corexy_fmi.kernel.stage_code import (
    FIRST_IDLER,
    forces,
    function,
    of_stage,
    offsets,
    section_sum,
    signed_sum,
)
from corexy_fmi.topology import Stage


def find_forces(stage: Stage) -> str:
    """`find_forces` of stage.c without belt hooks: the same operations in order, in registers.

    What nobody reads before the next step is not stored: eight lanes' stores take longer than sums.
    """
    count, lines = len(stage.coordinates), ["const double half = 0.5 * s->step;"]
    for i in range(count):
        drifted = f"drifted(s->q[{i}][l], v{i}, half)"
        lines += [f"double v{i} = s->v[{i}][l], q{i} = {drifted};"]
    for m, i in ((0, 2), (1, 3)):
        lines += [f"q{i} = pick(s->released[{m}][l] > 0, q{i}, s->command[{m}][l]);"]
        lines += [f"v{i} = pick(s->released[{m}][l] > 0, v{i}, s->command_rate[{m}][l]);"]
    lines += ["const double r = s->radius[0][l];", "(void)r;"]
    pulled = {c for section in stage.sections for c in section.row}
    turning = [i for i in range(2, count) if stage.coordinates[i] in pulled]
    lines += [f"const double u{i} = r * q{i};" for i in turning]
    for n, section in enumerate(stage.sections):
        elongation = section_sum(stage, section)
        lines += [f"const double tension{n} = s->stiffness[{n}][l] * ({elongation});"]
        lines += [f"if (kept) s->tension[{n}][l] = tension{n};"]
    for i, force in enumerate(forces(stage, "tension{}", ("r", "r"))):
        lines += _first_forces(i, force) if i < FIRST_IDLER else _idler_step(i, force)
    name = f"{stage.name}_find_forces"
    inner = function(
        f"{name}_as(stage *s, const int smooth, const int kept)",
        lines,
        "    (void)s; (void)smooth; (void)kept;\n",
    )
    return (
        inner.replace("static void", "INLINE void", 1)
        + f"static void {name}(stage *s)\n{{\n    if (s->smooth) {name}_as(s, 1, 1);\n"
        f"    else if (LANES == 1 || s->keeps_tensions || s->last) {name}_as(s, 0, 1);\n"
        f"    else {name}_as(s, 0, 0);\n}}\n"
    )


def _first_forces(i: int, force: str) -> list[str]:
    imposed = [f"s->v[{i}][l] = v{i};"] if i >= 2 else []
    return [f"s->q[{i}][l] = q{i};", *imposed, f"s->force[{i}][l] = {force};"]


def _idler_step(i: int, force: str) -> list[str]:
    return [
        f"v{i} = kicked_free(s, {i}, l, v{i}, {force}, smooth);",
        f"s->v[{i}][l] = v{i};",
        f"s->q[{i}][l] = drifted(q{i}, v{i}, half);",
    ]


def stretch(stage: Stage) -> str:
    """Drift of all but the motors, and elongations; the motors' travel is known."""
    count = len(stage.coordinates)
    lines = ["const double half = 0.5 * s->step, r = s->radius[0][l];", "(void)r; (void)half;"]
    for i in (i for i in range(count) if i not in (2, 3)):
        lines += [f"const double q{i} = drifted(s->q[{i}][l], s->v[{i}][l], half);"]
        lines += [f"s->q[{i}][l] = q{i};"]
    travel = {
        i: f"s->travel[{i - 2}][l]" if i < FIRST_IDLER else f"r * q{i}" for i in range(2, count)
    }
    lines += [f"const double u{i} = {value}; (void)u{i};" for i, value in travel.items()]
    for n, section in enumerate(stage.sections):
        lines += [f"s->elongation[{n}][l] = {section_sum(stage, section)};"]
    return of_stage(stage, "stretch", lines)


def find_pull(stage: Stage) -> str:
    """Net belt force on each motor at zero offset, and its slope over the offset."""
    lines = []
    for m, motor in enumerate(("phi1", "phi2")):
        held = [(n, s.row[motor]) for n, s in enumerate(stage.sections) if motor in s.row]
        pull = [(-w, f"s->stiffness[{n}][l] * s->elongation[{n}][l]") for n, w in held]
        lines.append(f"s->pull[{m}][l] = {signed_sum(pull)};")
        slope = [(w * w, f"s->stiffness[{n}][l]") for n, w in held]
        lines.append(f"s->pull_stiffness[{m}][l] = {signed_sum(slope)};")
    return of_stage(stage, "find_pull", lines)


def find_rate(stage: Stage) -> str:
    """Rate of each elongation in the middle of the step; imposed rates are those of the middle."""
    lines = ["const double r = s->radius[0][l];", "(void)r;"]
    for i in range(len(stage.coordinates)):
        lines.append(f"double q{i} = middle_velocity(s, {i}, l); (void)q{i};")
    for m, i in ((0, 2), (1, 3)):
        lines.append(f"q{i} = pick(s->released[{m}][l] > 0, q{i}, s->v[{i}][l]);")
    for i in range(2, len(stage.coordinates)):
        arm = f"s->gain[{i - 2}][l]" if i < FIRST_IDLER else "r"
        lines.append(f"const double u{i} = {arm} * q{i}; (void)u{i};")
    for n, section in enumerate(stage.sections):
        lines.append(f"s->rate[{n}][l] = {section_sum(stage, section)};")
    return of_stage(stage, "find_rate", lines)


def pull_idlers(stage: Stage) -> str:
    """From elongations to tensions and forces; the idlers' whole kick.  No hook runs in between."""
    name = f"{stage.name}_pull_idlers"
    head = "(stage *s, const int smooth, const int bent)"
    unused = "    (void)s; (void)smooth; (void)bent;\n"
    inner = function(f"{name}_as{head}", _pull_lines(stage, _rated), unused)
    choice = (
        f"    if (s->smooth) {name}_as(s, 1, 1);\n    else if (s->bent) {name}_as(s, 0, 1);\n"
        f"    else {name}_as(s, 0, 0);\n"
    )
    return inner.replace("static void", "INLINE void") + (
        f"static void {name}(stage *s)\n{{\n{choice}}}\n"
    )


def pull_tied(stage: Stage) -> str:
    """The same with the idlers tied together by their belts' damping."""
    name, own = f"{stage.name}_pull_tied", _pull_lines(stage, _tied) if idlers(stage) else []
    return by_smoothness(name, own, "const int bent = 1;")


def _pull_lines(stage: Stage, damped: Callable[[Stage], list[str]]) -> list[str]:
    """``damped``: from elastic tensions to those with damping, and forces."""
    lines = ["const double half = 0.5 * s->step, r = s->radius[0][l];", "(void)r; (void)half;"]
    for n, section in enumerate(stage.sections):
        elongation = [(1.0, f"s->elongation[{n}][l]"), *offsets(section)]
        lines += [f"const double e{n} = {signed_sum(elongation)};"]
        lines += [f"double tension{n} = s->stiffness[{n}][l] * e{n};"]
    lines += damped(stage)
    for n, section in enumerate(stage.sections):
        for axis, slope in enumerate(section.length_slope):
            if slope:
                sign = "-" if slope > 0 else "+"
                lines += [f"if (bent) f{axis} {sign}= 0.5 * s->slope[{n}][l] * e{n} * e{n};"]
    first = range(min(FIRST_IDLER, len(stage.coordinates)))
    return [*lines, *(f"s->force[{i}][l] = f{i};" for i in first)]


def _rated(stage: Stage) -> list[str]:
    """Damping by the rates that are known, then the idlers one by one."""
    lines = []
    for n in range(len(stage.sections)):
        damped = f"s->stiffness[{n}][l] * s->belt_time[{n}][l] * s->rate[{n}][l]"
        lines += [f"if (bent) tension{n} += {damped};", f"s->tension[{n}][l] = tension{n};"]
    for i, force in enumerate(_forces(stage)):
        lines += [f"double f{i} = {force};", *(_kicked_idler(i) if i >= FIRST_IDLER else [])]
    return lines


def _tied(stage: Stage) -> list[str]:
    """Idlers together with the damping between them."""
    lines = damped_lines(stage)
    lines += [f"s->tension[{n}][l] = tension{n};" for n in range(len(stage.sections))]
    return lines + [
        f"double f{i} = {force};" for i, force in enumerate(_forces(stage)[:FIRST_IDLER])
    ]


def _forces(stage: Stage) -> list[str]:
    return forces(stage, "tension{}", ("s->gain[{}][l]", "r"))


def _kicked_idler(i: int) -> list[str]:
    return [
        f"const double old{i} = s->v[{i}][l], v{i} = kicked_free(s, {i}, l, old{i}, f{i}, smooth);",
        f"if (bent) s->before[{i}][l] = old{i};",
        f"s->v[{i}][l] = v{i};",
        f"s->q[{i}][l] = drifted(s->q[{i}][l], v{i}, half);",
    ]
