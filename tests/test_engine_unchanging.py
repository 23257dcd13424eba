"""A friction that fades must do so while it is recorded: in a recording, or from one to another."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import machine, problem, record, rich_motion, with_effects

from corexy_fmi.effects import catalogue
from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.judging.unchanging import unchanging
from corexy_fmi.machine import EffectUse

KEY = ("friction_warmup", "xy")
COLD = {"extra_ratio": 3.0, "time_constant": 1.0, "viscous": 1.0}


def fitted(truth, told):
    """The effect fitted to what a machine did, from told values."""
    asked = problem(record(truth, rich_motion()), machine(), [KEY])
    u = np.zeros(asked.size)
    for k, unknown in enumerate(asked.unknowns):
        name = unknown.key.split(".", 2)[-1].partition("@")[0]
        u[k] = unknown.internal(told[name]) if name in told else 0.0
    return minimise(asked, u, 15)


def stiffer(factor):
    """A machine whose guides rub more than the file says, Coulomb and viscous alike."""
    given = machine()
    names = [
        n for n in given.parameters if "friction" in n and n.startswith(("carriage", "bridge"))
    ]
    more = {n: factor * given.parameters[n] for n in names}
    assert len(names) == 4
    return replace(given, parameters={**given.parameters, **more})


def test_what_fades_fades():
    fit = fitted(with_effects(machine(), EffectUse(*KEY, COLD)), COLD | {"onset": 0.0})
    assert unchanging(fit) == ""


@pytest.mark.parametrize("onset", [0.5, 50.0])
def test_friction_that_is_larger_than_the_file_says_does_not(onset):
    fit = fitted(stiffer(4.0), COLD | {"time_constant": 1e3, "onset": onset})
    assert unchanging(fit) == "friction_warmup changes nothing while it is recorded"


def test_nothing_is_asked_of_what_has_no_beginning():
    fit = problem(record(machine(), rich_motion()), machine(), [("constant_force", "x")])
    assert unchanging(minimise(fit, np.zeros(fit.size), 5)) == ""


def test_beginnings_of_the_catalogue_are_each_recordings_own():
    found = [(e.name, p) for e in catalogue().values() for p in e.parameters if p.begins]
    assert [(name, p.name) for name, p in found] == [(KEY[0], "onset")]
    assert all(p.local and p.unit == "s" for _, p in found)
