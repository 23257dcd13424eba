"""What a sweep varies: ``KEY=LOW:HIGH[:log]`` and ``KEY=FACTOR``, checked against the bounds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corexy_fmi.effects import catalogue
from corexy_fmi.errors import InputError
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import Machine
from corexy_fmi.simulate import machine_vector
from corexy_fmi.sweep.place import Place, find_place, with_effect

Array = NDArray[np.float64]
SCALES = ("uniform", "log")


@dataclass(frozen=True)
class Range:
    """One varied number: where it lies, its ends in its unit, and whether it is log-uniform."""

    place: Place
    low: float
    high: float
    log: bool = False

    def at(self, share: Array) -> Array:
        """Values at shares (n,) from 0 to 1 of the range."""
        if not self.log:
            return np.clip(self.low + share * (self.high - self.low), self.low, self.high)
        low, high = math.log(self.low), math.log(self.high)
        return np.clip(np.exp(low + share * (high - low)), self.low, self.high)


def read_ranges(
    vary: Iterable[str], spread: Iterable[str], machine: Machine
) -> tuple[tuple[Range, ...], Machine]:
    """The ranges of a command line, and the machine with every effect that they name.

    Raises InputError for an unknown key, a number out of bounds, a key given twice, none at all,
    and an effect of which a needed number is neither in the machine nor varied.
    """
    ranges = [_vary(text, machine) for text in vary]
    ranges += [_spread(text, machine) for text in spread]
    if not ranges:
        raise InputError("vary: found none, expected --vary KEY=LOW:HIGH or --spread KEY=FACTOR")
    keys = [r.place.key for r in ranges]
    for index, key in enumerate(keys):
        if key in keys[:index]:
            raise InputError(f"vary {key}: found twice, expected once")
    for key in keys:
        machine = with_effect(machine, key)
    _check_complete(machine, keys)
    return tuple(ranges), machine


def _vary(text: str, machine: Machine) -> Range:
    """``KEY=LOW:HIGH``, with ``:log`` or ``:uniform`` behind."""
    key, _, ends = text.partition("=")
    words = ends.split(":")
    if not key or not 2 <= len(words) <= 3 or words[2:] not in ([], *([s] for s in SCALES)):
        raise InputError(f"vary: found {text!r}, expected KEY=LOW:HIGH or KEY=LOW:HIGH:log")
    place = find_place(key.strip(), machine)
    low, high = (_number(word, f"vary {text!r}") for word in words[:2])
    return _checked(Range(place, low, high, words[2:] == ["log"]), f"vary {text!r}")


def _spread(text: str, machine: Machine) -> Range:
    """``KEY=FACTOR``: log-uniform, from the machine's value over the factor to it times that."""
    key, _, word = text.partition("=")
    if not key or not word:
        raise InputError(f"spread: found {text!r}, expected KEY=FACTOR")
    place, factor = find_place(key.strip(), machine), _number(word, f"spread {text!r}")
    value = float(machine_vector(machine)[place.index])
    if factor <= 1 or value <= 0:
        raise InputError(
            f"spread {text!r}: found factor {factor:g} of {value:g} {place.unit}, expected a "
            "factor above 1 of a value above 0"
        )
    return _checked(Range(place, value / factor, value * factor, True), f"spread {text!r}")


def _checked(found: Range, where: str) -> Range:
    """The range, inside its bounds and in order."""
    place = found.place
    for end in (found.low, found.high):
        if not place.lower <= end <= place.upper:
            raise InputError(
                f"{where}: found {end:g}, expected a value from {place.lower:g} to "
                f"{place.upper:g} [{place.unit}]"
            )
    if found.low >= found.high:
        raise InputError(f"{where}: found {found.low:g} to {found.high:g}, expected LOW below HIGH")
    if found.log and found.low <= 0:
        raise InputError(f"{where}: found {found.low:g} with log, expected LOW above 0")
    return found


def _number(word: str, where: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: found {word!r}, expected a finite number")
    return value


def _check_complete(machine: Machine, keys: Sequence[str]) -> None:
    """Every number of an effect that has no default is given by the machine or varied."""
    for use in machine.effects:
        for parameter in catalogue()[use.name].parameters:
            key = f"{use.name}.{use.location}.{parameter.name}"
            given = parameter.name in use.parameters or key in keys
            if parameter.default is None and not given:
                raise InputError(
                    f"vary: {key} is neither in the machine nor varied, "
                    f"expected --vary {key}=LOW:HIGH [{parameter.unit_at(use.location)}]"
                )


def base_vector(machine: Machine) -> Array:
    """The kernel's vector (layout.parameters,) of the machine, before anything is varied."""
    return machine_vector(machine, bundled_layout())
