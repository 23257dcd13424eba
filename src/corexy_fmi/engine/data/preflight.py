"""Preflight: wiring and units, before any physics (most real mismatches are one of these).

What the map from the predicted to the measured motion says (`wiring`) is undone in the data at
hand, so that a diagnosis follows, and told to the user with the fix.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.data.held import repeats
from corexy_fmi.engine.data.wiring import FEW, IDENTITY, Map, driven, fitted, orientation, predicted
from corexy_fmi.engine.evidence import Finding
from corexy_fmi.kernel.call import Array
from corexy_fmi.machine import Machine
from corexy_fmi.recording import Recording, is_dc

UNIT_BAND = 0.25  # a response within this band of a unit's factor is in that unit
STILL = 0.05  # response below which a channel shows none of the motion
FOLLOWS = 0.5  # share of a channel's variance that the motion explains on a sound rig
OFF = 0.05  # relative error of the travel above which the radius is doubted
CUT = 0.03  # share of samples at exactly one extreme from which on a channel is cut off
UNITS = {
    "x": ("m", {1e3: "mm", 1e2: "cm", 39.3701: "inch", 1e6: "um"}),
    "vx": ("m/s", {1e3: "mm/s", 1e2: "cm/s", 60.0: "m/min", 6e4: "mm/min"}),
    "ax": ("m/s^2", {1e3: "mm/s^2", 1e2: "cm/s^2", 1 / 9.80665: "g"}),
    "phi1_meas": ("rad", {180 / np.pi: "deg", 0.5 / np.pi: "revolutions"}),
}
COMMAND_UNITS = {np.pi / 180: "deg", 2 * np.pi: "revolutions"}  # travel over predicted travel
PAIRS = (("x", "y"), ("vx", "vy"), ("ax", "ay"), ("phi1_meas", "phi2_meas"))
WIRING = {
    "y mirrored": ", or the two motors are exchanged",
    "x and y swapped, both mirrored": ", or motor 1 turns the wrong way",
    "x and y swapped": ", or motor 2 turns the wrong way",
    "both axes mirrored": ", or both motors turn the wrong way",
}
ENCODERS = {
    "x mirrored": "encoder 1 counts backwards",
    "y mirrored": "encoder 2 counts backwards",
    "both axes mirrored": "both encoders count backwards",
    "x and y swapped": "the encoders are exchanged",
    "x and y swapped, both mirrored": "the encoders are exchanged and count backwards",
    "axes turned by +90 deg": "the encoders are exchanged and encoder 1 counts backwards",
    "axes turned by -90 deg": "the encoders are exchanged and encoder 2 counts backwards",
}
Check = Callable[["_Bench"], list[Finding]]


@dataclass
class _Bench:
    """A recording on its way through the checks; each of them may repair it."""

    recording: Recording
    machine: Machine
    response: Recording

    def map(self, pair: tuple[str, str]) -> Map | None:
        return fitted(self.recording, self.response, pair)

    def say(self, text: str, fix: str) -> Finding:
        return Finding(f"{self.recording.name}: {text}", fix)

    def put(self, **channels: Array) -> None:
        merged = {**self.recording.channels, **channels}
        self.recording = replace(self.recording, channels=merged)

    def drop(self, *names: str) -> None:
        kept = {n: v for n, v in self.recording.channels.items() if n not in names}
        self.recording = replace(self.recording, channels=kept)


def check(recording: Recording, machine: Machine) -> tuple[Recording, list[Finding]]:
    """The recording with wiring and units put right, and what was found."""
    response = predicted(recording, machine)
    if response is None or not driven(response):
        return recording, []
    bench = _Bench(recording, machine, response)
    found = [finding for step in STEPS for finding in step(bench)]
    return bench.recording, found


def _drive(bench: _Bench) -> list[Finding]:
    """A recording of dc motors for a machine of steppers, whose rotors are where they are told."""
    if bench.machine.drive != "stepper" or not is_dc(bench.recording):
        return []
    sign = "a controller" if "controller" in bench.recording.metadata else "voltages"
    fix = "Give a machine file with drive = 'dc'; phi1, phi2 are taken as steps here."
    return [bench.say(f"it has {sign}, as dc motors have; the machine has steppers", fix)]


def _dead(bench: _Bench) -> list[Finding]:
    """Channels that stand still although the stage moves along their axis."""
    found = []
    for channel in bench.recording.measured:
        values = bench.recording[channel]
        moves = bench.response[channel] if channel in bench.response else np.zeros(2)
        if np.nanmin(values) == np.nanmax(values) and np.ptp(moves) > 1e-3:
            found.append(_left_out(bench, channel, "never changes although the stage is driven"))
    return found


def _left_out(bench: _Bench, channel: str, what: str) -> Finding:
    bench.drop(channel)
    fix = f"Check the sensor and the wiring of {channel}; it is left out here."
    return bench.say(f"channel {channel} {what}", fix)


def _command_unit(bench: _Bench) -> list[Finding]:
    """Commanded angles in another unit: both axes travel by its factor too far or too little."""
    found = bench.map(("x", "y")) or bench.map(("vx", "vy"))
    if found is None or bench.machine.drive == "dc":
        return []
    factor, unit = _unit(found.sizes, COMMAND_UNITS)
    if not unit:
        return []
    bench.put(**{n: bench.recording[n] * factor for n in ("phi1", "phi2")})
    bench.response = predicted(bench.recording, bench.machine) or bench.response
    fix = f"Multiply phi1 and phi2 by {factor:.6g}; done here for this diagnosis."
    return [bench.say(f"phi1, phi2 are in {unit}, expected rad", fix)]


def _unit(sizes: Array, known: dict[float, str]) -> tuple[float, str]:
    """The unit that all responses (2,) have in common; (1, "") for none."""
    for factor, name in known.items():
        if (np.abs(sizes / factor - 1) < UNIT_BAND).all():
            return factor, name
    return 1.0, ""


def _silent_motor(bench: _Bench) -> list[Finding]:
    """A motor whose angle moves nothing."""
    found = bench.map(("x", "y"))
    if found is None or found.directions.shape[1] < 2 or np.isnan(found.rows).any():
        return []
    both = np.linalg.norm(found.rows @ np.array([[1.0, 1.0], [1.0, -1.0]]), axis=0)
    weak = int(np.argmin(both))
    if both[weak] > 0.1 * both.max():
        return []
    text = f"motor {weak + 1} does not move the stage although it is driven"
    return [bench.say(text, "Check its cable, its driver and the set screw of its pulley.")]


def _pairs(bench: _Bench) -> list[Finding]:
    """Units and orientation of each pair of measured channels."""
    return [finding for pair in PAIRS for finding in _pair(bench, pair)]


def _pair(bench: _Bench, pair: tuple[str, str]) -> list[Finding]:
    found = bench.map(pair)
    if found is None:
        return []
    factors, findings = _units(bench, pair, found)
    found = found.scaled(factors)
    name, turn = orientation(found)
    if name:
        findings.append(_turned(bench, pair, name, found.directions.shape[1] == 1))
    if name or (factors != 1).any():
        _repair(bench, pair, factors, turn)
    elif not _silent_motor(bench):
        findings += _astray(bench, pair, found)
    return findings


def _units(bench: _Bench, pair: tuple[str, str], found: Map) -> tuple[Array, list[Finding]]:
    """Factors (2,) to divide by, and what to say about them."""
    expected, known = UNITS[pair[0]]
    units = [_unit(np.full(2, size), known) for size in found.sizes]
    factors, findings = np.array([factor for factor, _ in units]), []
    for unit in dict.fromkeys(unit for _, unit in units if unit):
        here = [
            (n, f)
            for n, (f, u) in zip(pair, units, strict=True)
            if u == unit and n in bench.recording
        ]
        names = " and ".join(n for n, _ in here)
        fix = f"Divide {names} by {here[0][1]:.6g}; done here for this diagnosis."
        findings.append(bench.say(f"{names} in {unit}, expected {expected}", fix))
    return factors, findings


def _turned(bench: _Bench, pair: tuple[str, str], name: str, one_way: bool) -> Finding:
    """Axes that are not those of the command."""
    doubt = "; one direction of motion cannot tell more" if one_way else ""
    if pair[0] == "phi1_meas":
        fix = "Correct the encoders' wiring; undone here for this diagnosis."
        return bench.say(ENCODERS[name] + doubt, fix)
    also = WIRING.get(name, "") if pair[0] == "x" else f" ({', '.join(pair)})"
    fix = "Correct the sensor's axes or the motors' wiring; undone here for this diagnosis."
    return bench.say(f"{name} against the command{also}{doubt}", fix)


def _repair(bench: _Bench, pair: tuple[str, str], factors: Array, turn: Array) -> None:
    """Channels put into SI units and back on their own axes; true = turn' measured."""
    channels = bench.recording.channels
    measured = {n: channels[n] / f for n, f in zip(pair, factors, strict=True) if n in channels}
    bench.drop(*pair)
    for k, n in enumerate(pair):
        j = int(np.argmax(np.abs(turn[k])))
        if n in measured:
            bench.put(**{pair[j]: turn[k, j] * measured[n]})


def _astray(bench: _Bench, pair: tuple[str, str], found: Map) -> list[Finding]:
    """Channels that show none of the motion, or another one."""
    findings = []
    moves = np.linalg.norm(found.directions, axis=1) > 0.5
    for k, channel in enumerate(pair):
        if channel not in bench.recording or not moves[k] or not np.isfinite(found.follows[k]):
            continue
        if np.linalg.norm(found.response[k]) < STILL:
            findings.append(_left_out(bench, channel, "shows none of the commanded motion"))
        elif found.follows[k] < FOLLOWS and pair[0] == "x":
            text = f"channel {channel} hardly follows the commanded motion"
            findings.append(bench.say(text, "Check that commands and measurement are of one run."))
    return findings


def _radius(bench: _Bench) -> list[Finding]:
    """Both axes travel too far, or too little, by the same share."""
    found = bench.map(("x", "y"))
    if found is None or found.directions.shape[1] < 2 or np.isnan(found.rows).any():
        return []
    sizes = found.sizes
    ratio = float(sizes.mean())
    along = found.scaled(sizes).distance(IDENTITY) < 2 * OFF
    if abs(ratio - 1) < OFF or np.ptp(sizes) > 0.5 * abs(ratio - 1) or not along:
        return []
    radius = bench.machine.parameters["pulley_radius"]
    fix = f"pulley_radius looks like {radius * ratio:.5g} m, the machine file says {radius:.5g} m."
    return [bench.say(f"the path is {ratio:.3f} times the commanded one in both axes", fix)]


def _clipped(bench: _Bench) -> list[Finding]:
    """Channels that stay at exactly one value where the motion goes on."""
    findings = []
    for pair in PAIRS[:3]:
        for channel in (n for n in pair if n in bench.recording and n in bench.response):
            level = _cut(bench.recording[channel], bench.response[channel])
            if level is not None:
                text = f"channel {channel} is cut off at {level:.6g}"
                findings.append(bench.say(text, f"Widen its range: beyond {level:.6g} it is lost."))
    return findings


def _held(bench: _Bench) -> list[Finding]:
    """Samples of places that only repeat the one before: they are left out."""
    findings = []
    places = (n for pair in (PAIRS[0], PAIRS[3]) for n in pair)
    for channel in (n for n in places if n in bench.recording and n in bench.response):
        values = bench.recording[channel]
        again = repeats(values, bench.response[channel])
        if again.any():
            bench.put(**{channel: np.where(again, np.nan, values)})
            count, whole = int(np.sum(again)), int(np.isfinite(values).sum())
            text = f"{count} of {whole} samples of {channel} only repeat the one before"
            fix = "Log a blank where the sensor has nothing new; they are left out here."
            findings.append(bench.say(text, fix))
    return findings


def _cut(values: Array, course: Array) -> float | None:
    """The extreme at which a channel (n,) is held while its predicted course (n,) goes on."""
    seen = np.isfinite(values)
    values, course = values[seen], course[seen]
    if len(values) < FEW:
        return None
    for level in (float(values.max()), float(values.min())):
        held = values == level
        beyond = np.ptp(course[held]) > 0.1 * np.ptp(course)
        if beyond and held.mean() > CUT and held.sum() > 5 * _next_level(values, level):
            return level
    return None


def _next_level(values: Array, level: float) -> int:
    """How many samples have the value next to an extreme; a coarse sensor has many."""
    rest = values[values != level]
    nearest = rest[np.argmin(np.abs(rest - level))] if len(rest) else level
    return int((values == nearest).sum())


STEPS: tuple[Check, ...] = (
    _drive, _dead, _command_unit, _silent_motor, _pairs, _radius, _clipped, _held,
)  # fmt: skip
