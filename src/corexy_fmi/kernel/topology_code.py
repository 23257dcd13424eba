"""The topologies' tables as C: constants, elongations, generalised forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from corexy_fmi.kernel.damped_code import kick_tied, tie
from corexy_fmi.kernel.stage_code import FIRST_IDLER, forces, function, of_stage, signed_sum
from corexy_fmi.kernel.step_code import (
    find_forces,
    find_pull,
    find_rate,
    pull_idlers,
    pull_tied,
    stretch,
)
from corexy_fmi.kernel.trace import c_statements, symbols
from corexy_fmi.kernel.wide_code import (
    advance,
    advance_dc,
    advance_dc_smooth,
    advance_smooth,
)
from corexy_fmi.parameters import NOMINAL
from corexy_fmi.topology import STAGES, Section, Stage

STRUCT = """\
struct topology {
    int coordinates, sections;
    void (*derive)(stage *);
    void (*elongate)(const lane *restrict, const lane *restrict, lane *restrict);
    void (*collect)(stage *), (*measure)(stage *);
    void (*add_runout)(stage *), (*collect_runout)(stage *), (*find_forces)(stage *);
    void (*stretch)(stage *), (*find_pull)(stage *), (*find_rate)(stage *), (*pull_idlers)(stage *);
    void (*pull_tied)(stage *), (*tie)(stage *), (*kick_tied)(stage *);
    void (*advance)(stage *, sweep *), (*advance_smooth)(stage *, sweep *);
    void (*advance_dc)(stage *, sweep *), (*advance_dc_smooth)(stage *, sweep *);
    double weight[SECTIONS][COORDINATES], motor_weight[SECTIONS][2];
    double belt_sign[SECTIONS], side[SECTIONS], yaw_arm[SECTIONS];
    double rest[2][2];
    int direct[2];
};
"""


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
    rim *= values["pulley_smoothing_ratio"]
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
    return of_stage(stage, "derive", reads + lines + writes)


def _coordinate(name: str, xy: str, travel: str) -> str:
    return f"{xy}[{'xy'.index(name)}][l]" if name in "xy" else f"{travel}[{int(name[3:]) - 1}][l]"


def _elongate(stage: Stage) -> str:
    lines = []
    for i, section in enumerate(stage.sections):
        terms = [(w, _coordinate(c, "xy", "travel")) for c, w in section.row.items()]
        lines.append(f"e[{i}][l] = {signed_sum(terms)};")
    arguments = "(const lane *restrict xy, const lane *restrict travel, lane *restrict e)"
    return function(
        f"{stage.name}_elongate{arguments}", lines, "    (void)xy; (void)travel; (void)e;\n"
    )


def _collect(stage: Stage) -> str:
    """Forces of the tensions, and of stiffnesses that vary with the position."""
    arms = ("s->gain[{}][l]", "s->radius[0][l]")
    found = forces(stage, "s->tension[{}][l]", arms)
    lines = [f"s->force[{i}][l] = {force};" for i, force in enumerate(found)]
    slopes = []
    for n, section in enumerate(stage.sections):
        for axis, slope in enumerate(section.length_slope):
            if slope:
                energy = f"0.5 * s->slope[{n}][l] * s->elongation[{n}][l] * s->elongation[{n}][l]"
                slopes.append(f"        s->force[{axis}][l] {'-' if slope > 0 else '+'}= {energy};")
    body = "\n".join(slopes)
    hook = f"    if (s->active_count[PORT_BELT])\n        EACH {{\n{body}\n        }}\n"
    return of_stage(stage, "collect", lines, hook if slopes else "")


def _measure(stage: Stage) -> str:
    """Length of each section at the present position."""
    lines = []
    for n, section in enumerate(stage.sections):
        slopes = enumerate(section.length_slope)
        terms = [(float(slope), f"s->q[{axis}][l]") for axis, slope in slopes if slope]
        moved = f" + ({signed_sum(terms)})" if terms else ""
        lines.append(f"s->length[{n}][l] = s->length0[{n}][l]{moved};")
    return of_stage(stage, "measure", lines)


def _add_runout(stage: Stage) -> str:
    """Half of an idler's shift lengthens each neighbouring section."""
    lines = []
    for n, section in enumerate(stage.sections):
        idlers = [c for c in section.row if c not in ("x", "y", "phi1", "phi2")]
        lines += [f"s->elongation[{n}][l] += 0.5 * s->runout[{int(c[3:]) - 1}][l];" for c in idlers]
    return of_stage(stage, "add_runout", lines)


def _collect_runout(stage: Stage) -> str:
    """Torque of both neighbouring tensions on an idler that does not run true."""
    lines = []
    for i, coordinate in enumerate(stage.coordinates[FIRST_IDLER:], FIRST_IDLER):
        neighbours = [n for n, s in enumerate(stage.sections) if coordinate in s.row]
        tension = signed_sum([(1, f"s->tension[{n}][l]") for n in neighbours])
        slope = f"0.5 * s->runout_slope[{i - 2}][l]"
        lines.append(f"s->force[{i}][l] -= {slope} * ({tension});")
    return of_stage(stage, "collect_runout", lines)


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


FUNCTIONS = (
    _derive, _elongate, _collect, _measure, _add_runout, _collect_runout, find_forces,
    stretch, find_pull, find_rate, pull_idlers, pull_tied, tie, kick_tied, advance, advance_smooth,
    advance_dc, advance_dc_smooth,
)  # fmt: skip


def topology_code() -> str:
    """All topologies: their functions and the table that the step runs on."""
    functions = [write(stage) for stage in STAGES.values() for write in FUNCTIONS]
    rows = "".join(_table(stage) for stage in STAGES.values())
    table = f"static const struct topology TOPOLOGIES[] = {{\n{rows}}};\n"
    return "\n".join([*functions, STRUCT, table])
