"""Reference results inside an FMU, as the draft of the layered standard FMI-LS-REF lays them out.

Importers compare their own run of the input file, at the default experiment's step, with them.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, register_namespace, tostring

import numpy as np

from corexy_fmi.errors import InputError
from corexy_fmi.fmu.description import EXPERIMENT
from corexy_fmi.fmu.session import Session
from corexy_fmi.kernel.call import Array
from corexy_fmi.machine import Machine

FOLDER = "extra/org.fmi-standard.fmi-ls-ref"
STANDARD, NAMESPACE = "org.fmi-standard.fmi-ls-ref", "http://fmi-standard.org/fmi-ls-manifest"
STOP, STEP, EVERY = float(EXPERIMENT["stopTime"]), float(EXPERIMENT["stepSize"]), 5
BENDS = (0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)  # [s]
PATH = ((0, 0), (0, 0), (8e-3, 0), (8e-3, 6e-3), (0, 6e-3), (0, 0), (0, 0))  # [m]
VOLTS = ((0, 0), (0.5, 0.5), (0.5, -0.5), (-0.5, -0.5), (-0.5, 0.5), (0, 0))  # [V] after each bend
OUTPUTS = ("x", "y", "x_true", "y_true", "vx", "vy", "phi1_meas", "phi2_meas", "tension1")
Table = tuple[list[str], Array]


def reference_files(machine: Machine, native: Mapping[str, bytes], name: str) -> dict[str, bytes]:
    """Manifest, input and results of a machine by their names in an archive.

    ``native`` are the files of its native FMU with this host's binary, ``name`` the model
    identifier that the files are called after.
    Raises InputError where the FMU refuses to run the machine.
    """
    inputs = input_table(machine)
    return {
        f"{FOLDER}/fmi-ls-manifest.xml": _manifest(name),
        f"{FOLDER}/{name}_in.csv": _csv(*inputs),
        f"{FOLDER}/{name}_out.csv": _csv(*_results(machine, native, inputs)),
    }


def input_table(machine: Machine) -> Table:
    """Names and rows (2 bends, columns): two rows at each bend, as it is reached and as it is left.

    A small rectangle in angles [rad] and rates [rad/s], or voltages [V] for a dc machine.
    """
    time = np.repeat(BENDS, 2)[:, None]
    if machine.drive == "dc":
        volts = np.array(VOLTS, float)
        rows = np.vstack([volts[:1], np.repeat(volts, 2, axis=0), volts[-1:]])
        return ["time", "V1", "V2"], np.hstack([time, rows])
    x, y = np.array(PATH).T
    phi = np.column_stack([x + y, x - y]) / machine.parameters["pulley_radius"]
    slopes = np.diff(phi, axis=0) / np.diff(BENDS)[:, None]
    still = np.zeros((1, 2))
    rates = np.vstack([still, np.repeat(slopes, 2, axis=0), still])
    names = ["time", "phi1", "phi2", "phi1_rate", "phi2_rate"]
    return names, np.hstack([time, np.repeat(phi, 2, axis=0), rates])


def _at(inputs: Table, time: float) -> list[Any]:
    """Values just after a time: what is linear between two rows, from the right."""
    rows = inputs[1]
    last = int(np.searchsorted(rows[:, 0], time + STEP / 2)) - 1
    if last + 1 == len(rows):
        return rows[-1, 1:].tolist()
    before, after = rows[last], rows[last + 1]
    share = (time - before[0]) / (after[0] - before[0])
    return (before[1:] + share * (after[1:] - before[1:])).tolist()


def _results(machine: Machine, native: Mapping[str, bytes], inputs: Table) -> Table:
    """Outputs at every few steps of the default experiment."""
    fmu = Path(f"{machine.name}: its FMU")
    with tempfile.TemporaryDirectory(prefix="corexy-reference-") as place:
        folder = Path(place)
        for file, data in native.items():
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            (folder / file).write_bytes(data)
        with Session(fmu, folder) as session:
            return ["time", *OUTPUTS], _run(session, inputs)


def _run(session: Session, inputs: Table) -> Array:
    """Rows (points, 1 + outputs)."""
    first = dict(zip(inputs[0][1:], _at(inputs, 0.0), strict=True))
    session.start(0.0, first)
    setter, getter = session.setter(inputs[0][1:]), session.getter(OUTPUTS)
    rows: list[list[float]] = [[0.0, *map(float, getter.read())]]
    for n in range(round(STOP / STEP)):
        setter.values[:] = _at(inputs, n * STEP)
        setter.apply()
        session.step(n * STEP, STEP)
        if (n + 1) % EVERY == 0:
            rows.append([(n + 1) * STEP, *map(float, getter.read())])
    found = np.array(rows)
    if not np.isfinite(found).all():
        raise InputError("the reference run is not finite, expected a machine that can be run")
    return found


def _csv(names: list[str], rows: Array) -> bytes:
    """Numbers to twelve digits, so that no platform's last bit is in the file."""
    lines = [",".join(f"{value:.12g}" for value in row) for row in rows.tolist()]
    return "\n".join([",".join(names), *lines, ""]).encode()


def _manifest(name: str) -> bytes:
    """What the files are."""
    register_namespace("fmi-ls", NAMESPACE)
    told = {
        "fmi-ls-name": STANDARD,
        "fmi-ls-version": "1.0.0-alpha.1",
        "fmi-ls-description": "Files that belong to this FMU: an input and its reference results.",
    }
    root = Element("fmiReferences", {f"{{{NAMESPACE}}}{k}": v for k, v in told.items()})
    for role, file in (("input", f"{name}_in.csv"), ("result", f"{name}_out.csv")):
        SubElement(root, "Related", type="text/csv", source=file, role=role)
    indent(root)
    return tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"
