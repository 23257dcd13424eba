"""documentation/index.html inside the FMU: what it models, its variables, what inputs cost."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from corexy_fmi.bundled import bundled_folder
from corexy_fmi.effects.api import Effect
from corexy_fmi.fmu.variables import Variable
from corexy_fmi.machine import Machine

LICENCE_TEXT = """\
Licensed under the Apache License, Version 2.0 (the "License"); you may not use this FMU except in
compliance with the License.  You may obtain a copy of the License at

    http://www.apache.org/licenses/LICENSE-2.0

Unless required by applicable law or agreed to in writing, software distributed under the License is
distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or
implied.  See the License for the specific language governing permissions and limitations under the
License.

The headers fmi2*.h in sources/ are those of the Modelica Association, under the 2-clause BSD
licence that they carry.
"""
STYLE = """\
body{font:15px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}
table{border-collapse:collapse;margin:1em 0}code{font-size:90%}
td,th{border-bottom:1px solid #ccc;padding:.2em .8em .2em 0;text-align:left;vertical-align:top}"""
INTRODUCTION = """\
<p>A Core-XY stage after Yin et al., IEEE RCAR 2018: two motors, two belts over ten pulleys, a
bridge (y) and a carriage (x). <code>fidelity</code> chooses the model: <b>full</b> has 12 degrees
of freedom (carriage, bridge and every pulley on elastic belt sections), <b>reduced</b> has 4
(carriage, bridge, motors; the belts condensed), <b>condensed</b> the same 4 with the idlers shared
out by their static weights, <b>kinematic</b> is x = r (&phi;<sub>1</sub> + &phi;<sub>2</sub>)/2,
y = r (&phi;<sub>1</sub> - &phi;<sub>2</sub>)/2; <b>single_axis, two_mass, cartesian, h_frame</b>
are other stages, no Core-XY. <code>drive</code> says what
turns the motors: <b>stepper</b> follows the angles <code>phi1, phi2</code>, <b>dc</b> takes the
voltages <code>V1, V2</code>. Friction is set-valued (it sticks exactly); micro-steps follow from
the fastest pole of the machine, and any communication step above 0 is divided into whole ones.</p>
<p>A run starts at rest where the inputs phi1, phi2 at the end of initialisation point to. All
values are SI; x = y = 0 is the middle of the stage.</p>"""
INPUT_TEXT = """\
<p>A commanded angle moves inside a communication step: give its rate with
<code>fmi2SetRealInputDerivatives</code> (order 1), or as the input <code>phi1_rate,
phi2_rate</code> where the master knows no input derivatives. An angle that is only set stands
still during the step and jumps at its end, or, where <code>inputInterpolation</code> is
<b>ramp</b>, goes there from where the last step ended. Voltages are held. A corner of the path that
is no communication point is cut by the straight line between the two points around it: put a
communication point at each corner.</p>"""
FREE_FORM_TEXT = """\
<p><code>effects.free_form.LOCATION</code>: a force [N] on x or y, or a torque [N m] on a free
motor, over one <code>argument</code>, or with one of <code>friction_x, friction_y,
friction_t</code> a Coulomb friction [N] beside that of the axis, <code>viscous</code> [s/m] times
its speed larger; <code>count</code> knots are in use, linear between <code>knots[i],
values[i]</code>, constant outside; time counts from <code>onset</code> [s].</p>"""


def index_page(table: Sequence[Variable], machine: Machine, laws: Sequence[Effect]) -> str:
    """The page for an FMU that holds a machine and knows these effects."""
    parameters = [v for v in table if v.causality == "parameter"]
    plain = [v for v in parameters if not v.name.startswith("effects.")]
    effects = [v for v in parameters if v.name.startswith("effects.") and "free_form" not in v.name]
    body = [
        "<h1>Core-XY belt stage</h1>",
        INTRODUCTION,
        "<h2>Machine</h2>",
        _machine_text(machine),
        "<h2>Inputs</h2>",
        _variables([v for v in table if v.role == "input"]),
        INPUT_TEXT,
        _cost_table(),
        "<h2>Outputs</h2>",
        _variables([v for v in table if v.role == "output"]),
        "<h2>Parameters</h2>",
        "<p>All are fixed: they are set before the initialisation ends.</p>",
        _variables(plain),
        "<h2>Effects</h2>",
        _effects(laws),
        _variables(effects),
        "<h2>Free-form laws</h2>",
        FREE_FORM_TEXT,
    ]
    head = f'<meta charset="utf-8"><title>Core-XY belt stage</title><style>{STYLE}</style>'
    return "\n".join(
        [
            "<!DOCTYPE html>",
            f'<html lang="en"><head>{head}</head><body>',
            *body,
            "</body></html>",
            "",
        ]
    )


def _machine_text(machine: Machine) -> str:
    """What this FMU holds."""
    label = f" {escape(machine.surrogate)}." if machine.surrogate else ""
    found = [f"{use.name} at {use.location}" for use in machine.effects]
    found += [
        f"a free-form {law.acts} at {law.location} over {law.argument}"
        for law in machine.free_forms
    ]
    text = f"Effects: {escape(', '.join(found))}." if found else "Every effect is neutral."
    return (
        f"<p><b>{escape(machine.name)}</b>, drive {escape(machine.drive)}, fidelity "
        f"{escape(machine.fidelity)}.{label} {text} The start values below are its own.</p>"
    )


def _variables(variables: Iterable[Variable]) -> str:
    rows = [
        (_code(v.name), escape(v.unit or ""), _number(v.start), _range(v), escape(v.description))
        for v in variables
    ]
    return _table(("name", "unit", "start", "range", "meaning"), rows)


def _code(name: str) -> str:
    return f"<code>{escape(name)}</code>"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.6g}"


def _range(variable: Variable) -> str:
    if variable.lower is None or variable.upper is None:
        return ""
    return f"{variable.lower:g} to {variable.upper:g}"


def _effects(effects: Iterable[Effect]) -> str:
    rows = [(_code(e.name), *map(escape, (e.summary, e.remedy, e.citation))) for e in effects]
    return _table(("effect", "what it is", "what helps", "source"), rows)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ["<table>", "<tr>" + "".join(f"<th>{cell}</th>" for cell in head) + "</tr>"]
    lines += ["<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows]
    return "\n".join([*lines, "</table>"])


def measured_inputs() -> dict[str, Any] | None:
    """What `benchmarks/fmu_inputs.py` measured; None where its results did not travel along."""
    path = bundled_folder("benchmarks") / "results" / "fmu_inputs.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None


def cost_rows(measured: dict[str, Any]) -> list[tuple[str, ...]]:
    """Step [ms] and errors [um] as text: the head, then a row for each step."""
    columns = {
        "step_ms": "step [ms]",
        "ramped_um": "angles with rates [um]",
        "held_um": "angles held [um]",
        "off_grid_um": "with rates, corners between points [um]",
    }
    rows = [tuple(f"{float(f'{row[key]:.2g}'):g}" for key in columns) for row in measured["rows"]]
    return [tuple(columns.values()), *rows]


def _cost_table() -> str:
    """What held inputs and corners off the grid cost."""
    measured = measured_inputs()
    if measured is None:
        return ""
    head, *rows = cost_rows(measured)
    return f"<p>{escape(measured['caption'])}</p>" + _table(head, rows)
