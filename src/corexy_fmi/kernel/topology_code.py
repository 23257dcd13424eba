"""The topologies' tables as C: constants, elongations, generalised forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from corexy_fmi.kernel.trace import c_statements, symbols
from corexy_fmi.parameters import NOMINAL
from corexy_fmi.topology import STAGES, Section, Stage

FIRST_IDLER = 4  # place in q: x, y, two motors, then the idlers
STRUCT = """\
struct topology {
    int coordinates, sections;
    void (*derive)(stage *);
    void (*elongate)(const lane *restrict, const lane *restrict, lane *restrict);
    void (*collect)(stage *), (*measure)(stage *);
    void (*add_runout)(stage *), (*collect_runout)(stage *), (*find_forces)(stage *);
    void (*advance)(stage *, double, int64_t);
    double weight[SECTIONS][COORDINATES], motor_weight[SECTIONS][2];
    double belt_sign[SECTIONS], side[SECTIONS], yaw_arm[SECTIONS];
    double rest[2][2];
    int direct[2];
};
"""


def _signed_sum(terms: Sequence[tuple[float, str]]) -> str:
    text = ""
    for weight, name in terms:
        factor = name if abs(weight) == 1 else f"{abs(weight)!r} * {name}"
        sign = "-" if weight < 0 else "+"
        text += f" {sign} {factor}" if text else f"{'-' if weight < 0 else ''}{factor}"
    return text or "0.0"


def _function(head: str, lines: Sequence[str], before: str = "", after: str = "") -> str:
    """A C function whose lines run for each lane."""
    body = "\n".join(f"        {line}" for line in lines)
    return f"static void {head}\n{{\n{before}    EACH {{\n{body}\n    }}\n{after}}}\n"


def _of_stage(stage: Stage, name: str, lines: Sequence[str], after: str = "") -> str:
    return _function(f"{stage.name}_{name}(stage *s)", lines, "    (void)s;\n", after)


def _derive(stage: Stage) -> str:
    """Constants from the parameters."""
    names = stage.names()
    values: dict[str, Any] = dict(symbols([*filter(None, names), "dc"]))
    for name, p in zip(names, NOMINAL, strict=True):
        values[p.name] = values[name] if name else 0  # by its place, as the names below say it
    c = stage.constants(values, values["dc"])
    targets: dict[str, object] = {"s->radius[0][l]": values["pulley_radius"]}
    held = values["belt_damping_time"] if c.damping_time is None else c.damping_time
    targets["s->damping_time[0][l]"] = held
    targets["s->spacing[0][l]"] = values["bridge_pulley_spacing"]
    targets["s->damping_gain[0][l]"] = values["motor_damping_gain"]
    targets["s->back_emf[0][l]"] = values["motor_damping_gain"] / values["motor_torque_gain"]
    arrays = {"mass": c.mass, "damping0": c.viscous, "bound0": c.coulomb}
    rim = values["friction_smoothing"] / values["pulley_radius"]
    arrays["smoothing"] = (*[values["friction_smoothing"]] * 2, *[rim] * (len(c.mass) - 2))
    arrays |= {"stiffness0": c.stiffness, "length0": c.length}
    for array, items in arrays.items():
        targets |= {f"s->{array}[{i}][l]": value for i, value in enumerate(items)}
    lines, results = c_statements(targets)
    used = " ".join([*lines, *results.values()])
    reads = [
        f"const double {n} = s->parameter[{i}][l];" for i, n in enumerate(names) if n and n in used
    ]
    reads += ["const double dc = s->drive == DC ? 1.0 : 0.0;", "(void)dc;"]
    writes = [f"{target} = {value};" for target, value in results.items()]
    return _of_stage(stage, "derive", reads + lines + writes)


def _coordinate(name: str, xy: str, travel: str) -> str:
    return f"{xy}[{'xy'.index(name)}][l]" if name in "xy" else f"{travel}[{int(name[3:]) - 1}][l]"


def _elongate(stage: Stage) -> str:
    lines = []
    for i, section in enumerate(stage.sections):
        terms = [(w, _coordinate(c, "xy", "travel")) for c, w in section.row.items()]
        lines.append(f"e[{i}][l] = {_signed_sum(terms)};")
    arguments = "(const lane *restrict xy, const lane *restrict travel, lane *restrict e)"
    return _function(
        f"{stage.name}_elongate{arguments}", lines, "    (void)xy; (void)travel; (void)e;\n"
    )


def _forces(stage: Stage, tension: str, arms: tuple[str, str]) -> list[str]:
    """Generalised force of the belts on each coordinate; arms are the motors' and the idlers'."""
    forces = []
    for i, coordinate in enumerate(stage.coordinates):
        neighbours = [(n, s) for n, s in enumerate(stage.sections) if coordinate in s.row]
        force = _signed_sum([(-s.row[coordinate], tension.format(n)) for n, s in neighbours])
        arm = arms[i >= FIRST_IDLER].format(i - 2)
        forces.append(force if i < 2 else f"{arm} * ({force})")
    return forces


def _collect(stage: Stage) -> str:
    """Forces of the tensions, and of stiffnesses that vary with the position."""
    forces = _forces(stage, "s->tension[{}][l]", ("s->gain[{}][l]", "s->radius[0][l]"))
    lines = [f"s->force[{i}][l] = {force};" for i, force in enumerate(forces)]
    slopes = []
    for n, section in enumerate(stage.sections):
        for axis, slope in enumerate(section.length_slope):
            if slope:
                energy = f"0.5 * s->slope[{n}][l] * s->elongation[{n}][l] * s->elongation[{n}][l]"
                slopes.append(f"        s->force[{axis}][l] {'-' if slope > 0 else '+'}= {energy};")
    body = "\n".join(slopes)
    hook = f"    if (s->active_count[PORT_BELT])\n        EACH {{\n{body}\n        }}\n"
    return _of_stage(stage, "collect", lines, hook if slopes else "")


def _section_sum(stage: Stage, section: Section) -> str:
    """Elongation of a section from the local variables of `_find_forces`."""
    index = {c: i for i, c in enumerate(stage.coordinates)}
    name = {c: f"q{i}" if i < 2 else f"u{i}" for c, i in index.items()}
    return _signed_sum([(w, name[c]) for c, w in section.row.items()])


def _find_forces(stage: Stage) -> str:
    """`find_forces` of stage.c without belt hooks: the same operations in order, in registers."""
    count, lines = len(stage.coordinates), ["const double half = 0.5 * s->step;"]
    for i in range(count):
        drifted = f"drifted(s->q[{i}][l], v{i}, half)"
        lines += [f"double v{i} = s->v[{i}][l], q{i} = {drifted};"]
    for m, i in ((0, 2), (1, 3)):
        lines += [f"q{i} = s->released[{m}][l] > 0 ? q{i} : s->command[{m}][l];"]
        lines += [f"v{i} = s->released[{m}][l] > 0 ? v{i} : s->command_rate[{m}][l];"]
    lines += ["const double r = s->radius[0][l];", "(void)r;"]
    pulled = {c for section in stage.sections for c in section.row}
    turning = [i for i in range(2, count) if stage.coordinates[i] in pulled]
    lines += [f"const double u{i} = r * q{i};" for i in turning]
    for n, section in enumerate(stage.sections):
        elongation = _section_sum(stage, section)
        lines += [f"const double tension{n} = s->stiffness[{n}][l] * ({elongation});"]
        lines += [f"s->tension[{n}][l] = tension{n};"]
    for i, force in enumerate(_forces(stage, "tension{}", ("r", "r"))):
        lines += _first_forces(i, force) if i < FIRST_IDLER else _idler_step(i, force)
    name = f"{stage.name}_find_forces"
    inner = _function(
        f"{name}_as(stage *s, const int smooth)", lines, "    (void)s; (void)smooth;\n"
    )
    return (
        inner.replace("static void", "INLINE void", 1)
        + f"static void {name}(stage *s)\n{{\n    if (s->smooth) {name}_as(s, 1);\n"
        f"    else {name}_as(s, 0);\n}}\n"
    )


def _first_forces(i: int, force: str) -> list[str]:
    return [f"s->q[{i}][l] = q{i};", f"s->v[{i}][l] = v{i};", f"s->force[{i}][l] = {force};"]


def _idler_step(i: int, force: str) -> list[str]:
    return [
        f"v{i} = kicked_free(s, {i}, l, v{i}, {force}, smooth);",
        f"s->v[{i}][l] = v{i};",
        f"s->q[{i}][l] = drifted(q{i}, v{i}, half);",
    ]


def _measure(stage: Stage) -> str:
    """Length of each section at the present position."""
    lines = []
    for n, section in enumerate(stage.sections):
        slopes = enumerate(section.length_slope)
        terms = [(float(slope), f"s->q[{axis}][l]") for axis, slope in slopes if slope]
        moved = f" + ({_signed_sum(terms)})" if terms else ""
        lines.append(f"s->length[{n}][l] = s->length0[{n}][l]{moved};")
    return _of_stage(stage, "measure", lines)


def _add_runout(stage: Stage) -> str:
    """Half of an idler's shift lengthens each neighbouring section."""
    lines = []
    for n, section in enumerate(stage.sections):
        idlers = [c for c in section.row if c not in ("x", "y", "phi1", "phi2")]
        lines += [f"s->elongation[{n}][l] += 0.5 * s->runout[{int(c[3:]) - 1}][l];" for c in idlers]
    return _of_stage(stage, "add_runout", lines)


def _collect_runout(stage: Stage) -> str:
    """Torque of both neighbouring tensions on an idler that does not run true."""
    lines = []
    for i, coordinate in enumerate(stage.coordinates[FIRST_IDLER:], FIRST_IDLER):
        neighbours = [n for n, s in enumerate(stage.sections) if coordinate in s.row]
        tension = _signed_sum([(1, f"s->tension[{n}][l]") for n in neighbours])
        slope = f"0.5 * s->runout_slope[{i - 2}][l]"
        lines.append(f"s->force[{i}][l] -= {slope} * ({tension});")
    return _of_stage(stage, "collect_runout", lines)


def _row(values: Sequence[float]) -> str:
    return "{" + ", ".join(repr(float(v)) for v in values) + "}"


def _row_of_flags(values: Sequence[bool]) -> str:
    return "{" + ", ".join(str(int(v)) for v in values) + "}"


def _table(stage: Stage) -> str:
    """One row of the table that the step runs on."""
    sections = stage.sections or (Section("none", 1, {}),)
    weights = [_row([s.row.get(c, 0) for c in stage.coordinates]) for s in sections]
    motors = [_row([s.row.get("phi1", 0), s.row.get("phi2", 0)]) for s in sections]
    sign = _row([1.0 if s.belt == 1 else -1.0 for s in sections])
    names = [f"{stage.name}_{f.__name__.lstrip('_')}" for f in FUNCTIONS]
    counts = f"{len(stage.coordinates)}, {len(stage.sections)}"
    body = [f"{counts}, {', '.join(names)}", f"{{{', '.join(weights)}}}"]
    body += [f"{{{', '.join(motors)}}}", sign, _row([s.side for s in sections])]
    body += [_row([s.yaw_arm for s in sections])]
    body += [f"{{{', '.join(_row(pair) for pair in stage.rest)}}}", _row_of_flags(stage.direct)]
    return "    {" + ",\n     ".join(body) + "},\n"


def _advance(stage: Stage) -> str:
    """All micro-steps of a communication step but the last, in registers, where no hook runs.

    The same operations in the same order as `micro_step` of stage.c, which makes the last one.
    Constants are read in every step: kept in registers they would push the state out of them.
    """
    head = f"static void {stage.name}_advance(stage *s, double start, int64_t count)"
    if not stage.sections:
        return f"{head}\n{{\n    (void)s; (void)start; (void)count;\n}}\n"
    free = [i for i in range(len(stage.coordinates)) if i not in (2, 3)]
    load = [f"wide q{i} = WIDE(s->q[{i}]), v{i} = WIDE(s->v[{i}]);" for i in free]
    store = [f"WIDE(s->q[{i}]) = q{i}, WIDE(s->v[{i}]) = v{i};" for i in free]
    before = ["const double h = s->step, half = 0.5 * s->step;", "double time = start;", *load]
    lines = ["{", *before, "for (int64_t n = 1; n < count; n++) {", "FENCE;"]
    lines += [*_advance_step(stage, free), "}", *store, "s->time = time;", "}"]
    return "\n".join([head, *lines, ""])


def _advance_step(stage: Stage, free: Sequence[int]) -> list[str]:
    """One micro-step on local variables."""
    lines = ["const double end = start + (double)n * h, now = 0.5 * (time + end);"]
    lines += ["const wide r = WIDE(s->radius[0]);", "(void)r;"]
    for m, i in ((0, 2), (1, 3)):
        angle = f"s->input[{m}] + s->input_rate[{m}] * (now - s->input_time)"
        lines += [f"const wide q{i} = spread({angle});"]
    lines += [f"q{i} = q{i} + half * v{i};" for i in free]
    lines += [f"const wide u{i} = r * q{i}; (void)u{i};" for i in range(2, len(stage.coordinates))]
    for n, section in enumerate(stage.sections):
        elongation = _section_sum(stage, section)
        lines += [f"const wide tension{n} = WIDE(s->stiffness[{n}]) * ({elongation});"]
    for i, force in enumerate(_forces(stage, "tension{}", ("r", "r"))):
        if i in free:
            kept = f"WIDE(s->keep[{i}]) * v{i} + WIDE(s->push[{i}]) * ({force})"
            lines += [f"v{i} = halt({kept}, WIDE(s->slip[{i}]));", f"q{i} = q{i} + half * v{i};"]
    return [*lines, "time = end;"]


FUNCTIONS = (
    _derive, _elongate, _collect, _measure, _add_runout, _collect_runout, _find_forces, _advance,
)  # fmt: skip


def topology_code() -> str:
    """All topologies: their functions and the table that the step runs on."""
    functions = [write(stage) for stage in STAGES.values() for write in FUNCTIONS]
    rows = "".join(_table(stage) for stage in STAGES.values())
    table = f"static const struct topology TOPOLOGIES[] = {{\n{rows}}};\n"
    return "\n".join([*functions, STRUCT, table])
