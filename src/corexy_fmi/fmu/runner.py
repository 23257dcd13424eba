"""Drive an FMU with fmpy over the rows of a recording."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

from corexy_fmi.errors import InputError
from corexy_fmi.fmu.session import Session, unpacked
from corexy_fmi.fmu.variables import machine_table
from corexy_fmi.kernel.call import Array, Excitation
from corexy_fmi.kernel.clock import clocked, restamp
from corexy_fmi.kernel.layout import Layout, bundled_layout
from corexy_fmi.machine import Machine
from corexy_fmi.machine.check import machine_from
from corexy_fmi.recording import Recording, with_lost_rows
from corexy_fmi.simulate import excitation, machine_vector

ANGLES, VOLTAGES, RATES = ("phi1", "phi2"), ("V1", "V2"), ("phi1_rate", "phi2_rate")
OUTPUTS = ("x", "y", "vx", "vy", "ax", "ay", "phi1_meas", "phi2_meas")
SPEEDS = ("omega1", "omega2")


def run_fmu(
    fmu: Path,
    recording: Recording,
    machine: Machine | None = None,
    layout: Layout | None = None,
) -> Recording:
    """Response of an FMU to a recording's inputs, at its rows; the channels of `simulate`.

    Angles are set with their rates at each row, voltages are held until the next, and the loop of
    a dc recording is closed on the motor angles that the FMU reports:
    V_n = kp (ref_n - phi_n) + kd (slope_n - omega_n), held until row n + 1.

    Without a machine the FMU runs as it is, with its own; with one, the FMU's parameters are set to
    it.  ``layout`` is needed for effects that are not bundled.  Raises InputError for a file that
    is no FMU, and with the FMU's own sentence where it refuses a value or a step.
    """
    with unpacked(fmu) as folder:
        chosen = carried_machine(folder, fmu.name) if machine is None else machine
        whole = with_lost_rows(recording)
        drive = excitation(chosen, whole)
        values = {} if machine is None else parameter_values(machine, layout)
        with Session(fmu, folder) as session:
            outputs, volts = _run(session, drive, values)
    rows = np.searchsorted(whole.time, recording.time)
    outputs, volts = outputs[:, rows], volts[:, rows]
    layout = layout or bundled_layout()
    vector = machine_vector(chosen, layout)[None]
    restamp(layout, vector, recording.time, OUTPUTS, outputs[None])  # not the FMU's to do
    given = {n: v for n, v in recording.channels.items() if n in (*ANGLES, *VOLTAGES)}
    if drive.mode == "closed_loop":
        given |= dict(zip(VOLTAGES, volts, strict=True))
    response = dict(zip(OUTPUTS, outputs, strict=True))
    return Recording(recording.name, recording.time, given | response, dict(recording.metadata))


def carried_machine(folder: Path, name: str) -> Machine:
    """The machine in an unpacked FMU, of its effects only a wrong clock.

    Raises InputError without one.
    """
    path = folder / "resources" / "machine.toml"
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(
            f"{name}: no resources/machine.toml, expected an FMU of this project"
        ) from error
    clocks = {i.effect.name for i in clocked(bundled_layout())}
    uses = document.get("effects", [])
    if isinstance(uses, list):  # else `machine_from` refuses it
        document["effects"] = [
            use for use in uses if not isinstance(use, dict) or use.get("name") in clocks
        ]
    return machine_from(document, f"{name}: resources/machine.toml", name)


def parameter_values(machine: Machine, layout: Layout | None = None) -> dict[str, float]:
    """Value of every parameter of the FMU by its name, for a machine; also fmpy's start_values."""
    table = machine_table(machine, layout or bundled_layout())
    return {v.name: v.start for v in table if v.causality == "parameter" and v.start is not None}


def _run(session: Session, drive: Excitation, values: dict[str, float]) -> tuple[Array, Array]:
    """Outputs (8, rows) and voltages (2, rows)."""
    time = drive.time.tolist()
    session.start(time[0], dict(zip(ANGLES, drive.start(), strict=True)), values)
    feed = _Angles(session, drive) if drive.mode == "angles" else _Volts(session, drive)
    read = session.getter([*OUTPUTS, *SPEEDS])
    rows = np.empty((len(time), len(OUTPUTS) + len(SPEEDS)))
    for row, now in enumerate(time):
        state = read.read()
        rows[row] = state
        feed.apply(row, state)
        if row + 1 < len(time):
            session.step(now, time[row + 1] - now)
    return rows[:, : len(OUTPUTS)].T.copy(), feed.volts


def _slopes(drive: Excitation) -> Array:
    """Slope of both inputs on the interval that starts at each row, (rows, 2); 0 at the last."""
    both = np.column_stack([drive.input1, drive.input2])
    return np.vstack([np.diff(both, axis=0) / np.diff(drive.time)[:, None], np.zeros((1, 2))])


class _Angles:
    """Commanded angles with their rates: as input derivatives, or as inputs without those."""

    def __init__(self, session: Session, drive: Excitation) -> None:
        self.volts: Array = np.zeros((2, len(drive.time)))
        self._ramps = session.ramps
        self._setter = session.setter(ANGLES if self._ramps else (*ANGLES, *RATES))
        self._values = np.column_stack([drive.input1, drive.input2]).tolist()
        self._slopes = _slopes(drive).tolist()

    def apply(self, row: int, state: object) -> None:
        setter = self._setter
        setter.values[:2] = self._values[row]
        if self._ramps:
            setter.apply()
            setter.rates[:] = self._slopes[row]
            setter.apply_rates()
        else:
            setter.values[2:] = self._slopes[row]
            setter.apply()


class _Volts:
    """Voltages: the recording's, or those of the loop on the rotors' angles and speeds."""

    def __init__(self, session: Session, drive: Excitation) -> None:
        self.volts: Array = np.zeros((2, len(drive.time)))
        self._setter = session.setter(VOLTAGES)
        self._inputs = np.column_stack([drive.input1, drive.input2]).tolist()
        self._slopes = _slopes(drive).tolist()
        self._gains = (
            (drive.kp, drive.kd, drive.rate_weight) if drive.mode == "closed_loop" else None
        )

    def apply(self, row: int, state: object) -> None:
        values = self._inputs[row]
        if self._gains is not None:
            kp, kd, weight = self._gains
            phi, omega = state[6:8], state[8:10]  # type: ignore[index]
            slope = self._slopes[row]
            values = [
                kp * (values[i] - phi[i]) + kd * (weight * slope[i] - omega[i]) for i in (0, 1)
            ]
        self._setter.values[:] = values
        self._setter.apply()
        self.volts[:, row] = values
