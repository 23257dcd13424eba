"""The one way to run a machine's model: a recording's inputs in, its response out."""

from __future__ import annotations

import numpy as np

from corexy_fmi.kernel.call import Array, Excitation, run_lanes
from corexy_fmi.kernel.layout import (
    FREE_FORM_LOCATIONS,
    FREE_FORM_SIZE,
    LAW_KINDS,
    Layout,
    bundled_layout,
    free_form_vector,
)
from corexy_fmi.machine import FreeForm, Machine
from corexy_fmi.parameters import NOMINAL
from corexy_fmi.recording import Recording, check_drive, controller, inputs, with_lost_rows
from corexy_fmi.topologies import BY_EQUATION_1

CHANNELS = ("x", "y", "vx", "vy", "ax", "ay", "phi1", "phi2", "V1", "V2")


def neutral_vector(layout: Layout) -> Array:
    """Parameter vector of the bare yin2018 machine: every effect at its neutral value."""
    vector = np.zeros(layout.parameters)
    vector[: len(NOMINAL)] = [p.default for p in NOMINAL]
    for instance in layout.instances:
        values = [p.neutral for p in instance.effect.parameters]
        vector[instance.parameter : instance.parameter + len(values)] = values
    return vector


def _write_free_form(layout: Layout, vector: Array, law: FreeForm) -> None:
    first = layout.free_form + FREE_FORM_LOCATIONS.index(law.location) * FREE_FORM_SIZE
    kind = LAW_KINDS.index((law.acts, law.argument))
    told = free_form_vector(kind, law.knots, law.values, law.viscous, law.onset)
    vector[first : first + FREE_FORM_SIZE] = told


def machine_vector(machine: Machine, layout: Layout | None = None) -> Array:
    """The kernel's parameter vector (layout.parameters,) of a machine with its effects."""
    layout = layout or bundled_layout()
    vector = neutral_vector(layout)
    for p in NOMINAL:
        vector[p.place] = 0.0 if p.lower == 0 else p.default  # not read where it is not the stage's
    for p in machine.kind.parameters:
        vector[p.place] = machine.parameters[p.name]
    for use in machine.effects:
        instance = layout.find(use.name, use.location)
        for k, parameter in enumerate(instance.effect.parameters):
            fallback = parameter.neutral if parameter.default is None else parameter.default
            vector[instance.parameter + k] = use.parameters.get(parameter.name, fallback)
    for law in machine.free_forms:
        _write_free_form(layout, vector, law)
    return vector


def _first_angles(machine: Machine, recording: Recording) -> tuple[float, float]:
    """dc without references: the first encoder values, else eq. (1) of the first x, y, else 0."""
    channels = recording.channels
    if machine.kind.motors == 1:
        return _first_angle(machine, recording), 0.0
    for names in (("phi1_meas", "phi2_meas"), ("x", "y")):
        if all(n in channels and np.isfinite(channels[n]).any() for n in names):
            a, b = (float(channels[n][np.isfinite(channels[n])][0]) for n in names)
            return (a, b) if names[0] != "x" else _angles(machine, a, b)
    return 0.0, 0.0


def _angles(machine: Machine, x: float, y: float) -> tuple[float, float]:
    """Motor angles [rad] at rest at a position [m], eq. (1)."""
    radius = machine.parameters["pulley_radius"]
    if machine.topology in BY_EQUATION_1:
        return (x + y) / radius, (x - y) / radius
    return x / radius, y / radius


def _first_angle(machine: Machine, recording: Recording) -> float:
    """The same of a stage with one motor: its encoder, else x, else 0."""
    for name, travel in (("phi1_meas", 1.0), ("x", machine.parameters["pulley_radius"])):
        seen = recording.channels.get(name, np.empty(0))
        seen = seen[np.isfinite(seen)]
        if len(seen):
            return float(seen[0]) / travel
    return 0.0


def _held(machine: Machine, recording: Recording) -> tuple[float, float] | None:
    """Where a directly driven axis rests before its loop closes: where it is measured, if it is."""
    measured = {"phi1_meas", "x"} & set(recording.measured)
    if machine.kind.motors != 1 or not measured:
        return None
    return _first_angle(machine, recording), 0.0


def excitation(machine: Machine, recording: Recording) -> Excitation:
    """What drives a recording: angles, voltages, or references with its loop or the machine's."""
    check_drive(recording, machine)
    given = inputs(recording)
    if machine.kind.motors == 1:
        given |= {n: np.zeros(len(recording.time)) for n in ("phi2", "V2")}
    if machine.drive == "stepper":
        return Excitation(recording.time, given["phi1"], given["phi2"])
    loop = (controller(recording) or machine.controller) if "phi1" in given else None
    if loop is not None:
        return Excitation(
            recording.time,
            given["phi1"],
            given["phi2"],
            "closed_loop",
            loop.kp,
            loop.kd,
            first_angles=_held(machine, recording),
            rate_weight=loop.rate_weight,
        )
    first = _first_angles(machine, recording)
    return Excitation(recording.time, given["V1"], given["V2"], "voltages", first_angles=first)


def simulate(machine: Machine, recording: Recording, layout: Layout | None = None) -> Recording:
    """Replay a recording's inputs on a machine; the response has the recording's rows.

    Stepper machines are driven by phi1, phi2; dc machines by V1, V2, or in closed loop where the
    recording holds references and names its controller, or else the machine has one; V1, V2 are
    the loop's then.  ``layout`` is needed for effects that are
    not bundled.  Rows that were lost are run, and left out of the response.
    """
    whole = with_lost_rows(recording)
    rows = np.searchsorted(whole.time, recording.time)
    drive = excitation(machine, whole)
    layout = layout or bundled_layout()
    vector, dc = machine_vector(machine, layout), machine.drive == "dc"
    out = run_lanes(layout, drive, vector[None], fidelity=machine.stage, dc=dc, channels=CHANNELS)[
        0
    ]
    response = dict(zip(CHANNELS, out[:, rows], strict=True))
    angles = {"phi1_meas": response.pop("phi1"), "phi2_meas": response.pop("phi2")}
    volts = {n: response.pop(n) for n in ("V1", "V2")}
    given = {n: v for n, v in recording.channels.items() if n in ("phi1", "phi2", "V1", "V2")}
    if drive.mode == "closed_loop":
        given |= volts
    return Recording(
        recording.name, recording.time, given | response | angles, dict(recording.metadata)
    )
