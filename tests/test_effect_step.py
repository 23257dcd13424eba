"""What an effect changes is the same at the automatic step as at a much shorter one."""

import numpy as np
import pytest

from corexy_fmi.effects import catalogue
from corexy_fmi.kernel.call import Excitation, run_lanes, step_limit
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import load_machine
from corexy_fmi.simulate import machine_vector

LAYOUT = bundled_layout()
MACHINE = {"stepper": "yin2018", "dc": "yin2018_dc"}
TIME = 1e-3 * np.arange(1000)
SHORT = 5e-6  # [s]
SEAT = 2e-7  # [m] rms: where dry friction comes to rest differs by this much from step to step
SLIPS = "stepper_compliance"  # rotors that slip poles part from one another at any step
PLACES = [
    (i.effect.name, i.location, drive)
    for i in LAYOUT.instances
    for drive in i.effect.drives
    if i.effect.name != SLIPS
]


def excitation(drive: str) -> Excitation:
    if drive == "dc":
        volts = np.repeat(np.random.default_rng(1).uniform(-2, 2, (50, 2)), 20, axis=0)
        volts[0] = 0.0
        return Excitation(TIME, volts[:, 0], volts[:, 1], mode="voltages")
    rise = np.minimum(1.0, 4 * TIME)
    first = 8 * np.sin(8.2 * TIME) + 0.05 * np.sin(107 * TIME)
    return Excitation(TIME, rise * first, rise * 6 * np.sin(5.7 * TIME + 0.3))


def change(name: str, location: str, drive: str, values: list[float]) -> tuple[float, float]:
    """Rms change by an effect [m], and how far that at the automatic step is off, as a share."""
    machine = load_machine(MACHINE[drive])
    bare = machine_vector(machine, LAYOUT)
    acting = bare.copy()
    first = LAYOUT.find(name, location).parameter
    acting[first : first + len(values)] = values
    own = [step_limit(LAYOUT, v, fidelity="full", dc=drive == "dc") for v in (bare, acting)]
    changes = []
    for step in (min(own), SHORT):
        sets = np.array([bare, acting])
        out = run_lanes(LAYOUT, excitation(drive), sets, dc=drive == "dc", limit=step)[:, :2]
        changes.append(out[1] - out[0])
    size = float(np.sqrt(np.mean(changes[1] ** 2)))
    return size, float(np.sqrt(np.mean((changes[0] - changes[1]) ** 2))) / max(size, 1e-15)


@pytest.mark.parametrize(("name", "location", "drive"), PLACES)
def test_the_automatic_step_resolves_every_effect(name, location, drive):
    size, off = change(name, location, drive, [p.starts[0] for p in catalogue()[name].parameters])
    assert off < 0.1 or off * size < SEAT


@pytest.mark.parametrize("lag", [1e-4, 3e-4, 1e-3])
def test_a_lag_shorter_than_the_step_is_as_late_as_it_is(lag):
    size, off = change("winding_lag", "motors", "dc", [lag])
    assert size == pytest.approx(21e-3 * lag, rel=0.2)
    assert off < 0.1
