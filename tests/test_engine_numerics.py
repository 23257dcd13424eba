"""The numerics of dry friction are a nuisance, at the guides and at the pulleys."""

from dataclasses import replace

import pytest
from engine_kit import fitted, machine, problem, record, short_motion

from corexy_fmi.engine.fitting import unknowns
from corexy_fmi.machine import load_machine
from corexy_fmi.parameters import NUMERICS
from corexy_fmi.topologies import TOPOLOGIES


@pytest.fixture(scope="module")
def rounded():
    """A closed loop of a stage whose pulleys' friction sets in four times as slowly as that of its
    guides: at rest its motors creep.
    """
    nominal = load_machine("light_bench")
    dc = machine("yin2018_dc")
    drive = {k: dc.parameters[k] for k in ("motor_inertia", "motor_torque_gain")}
    given = replace(nominal, drive="dc", controller=dc.controller)
    given = replace(given, parameters=given.parameters | drive)
    numerics = dict(zip(NUMERICS, (5e-5, 4.0), strict=True))
    truth = replace(given, parameters=given.parameters | numerics)
    return given, record(truth, short_motion(), noise=5e-6)


def test_each_scale_is_found(rounded, monkeypatch):
    """One scale for both leaves more than what is named: a null of the concealed plant's was
    doubted by 122 nats.
    """
    given, recording = rounded
    chosen = problem(recording, given, std=5e-6)
    fit = fitted(chosen, 30)
    found = {x.key: float(x.value(u)) for x, u in zip(chosen.unknowns, fit.u, strict=False)}
    assert found["pulley_smoothing_ratio"] == pytest.approx(4.0, rel=0.5)
    assert found["friction_smoothing"] == pytest.approx(5e-5, rel=0.5)
    monkeypatch.setattr(unknowns, "OTHER", 1e-9)
    assert fitted(problem(recording, given, std=5e-6), 30).cost > fit.cost + 10


@pytest.mark.parametrize("kind", TOPOLOGIES.values(), ids=list(TOPOLOGIES))
def test_a_stage_without_pulleys_of_its_own_friction_has_one_scale(kind):
    names = {p.name for p in kind.parameters}
    assert "friction_smoothing" in names
    assert ("pulley_smoothing_ratio" in names) == ("pulley_coulomb_friction" in names)
