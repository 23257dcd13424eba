"""Detents are begun from the soft field that stood for them."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import fitted, machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting.fit import minimise, settle
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.entries import entry_of
from corexy_fmi.engine.naming.kindred import kindred, with_kindred
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.naming.search import long_fit
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

TRUTH = {"torque": 0.05, "phase": -2.5, "holding_torque": 0.365, "damping": 1e-3}
NOISE = 4e-6  # [m]
DETENTS = ("detent_torque", "motors")


def single(name):
    return Hypothesis((bundled_layout().find(name, "motors"),))


@pytest.fixture(scope="module")
def shown():
    truth = with_effects(machine("light_bench"), EffectUse(*DETENTS, TRUTH))
    return record(truth, rich_motion(), noise=NOISE, tracker=4)


@pytest.fixture(scope="module")
def base(shown):
    return settle(fitted(problem(shown, machine("light_bench"), std=NOISE)))


@pytest.fixture(scope="module")
def soft(base):
    (lead,) = screen(base, [single("stepper_compliance")])
    ends = [long_fit(minimise(lead.problem, start, 5)) for start in lead.starts]
    return settle(min(ends, key=lambda fit: fit.cost))


def test_detents_are_found_from_the_soft_field_that_stood_for_them(base, soft, shown):
    """Most of what the truth gains, where their signature promises next to nothing: rotors snap,
    and fits end 80 to 160 nats of 1000 short of it (four recordings).
    """
    singles = [single("detent_torque"), single("stepper_compliance"), single("backlash")]
    (found,) = kindred([base, soft], singles, map)
    best = settle(minimise(found.problem, planted(found.problem), 15))
    assert best.cost < found.cost + 5.0
    assert base.cost - found.cost > 0.8 * (base.cost - best.cost)
    assert base.cost - found.cost > 10 * screen(base, singles[:1])[0].gain
    assert 0.005 < found.value("detent_torque.motors.torque") < 0.06


def planted(chosen, truth=TRUTH):
    """Internal vector of the truth but for what retuning finds."""
    u = np.zeros(chosen.size)
    for k, unknown in enumerate(chosen.unknowns):
        place, _, name = unknown.key.rpartition(".")
        if place == ".".join(DETENTS):
            u[k] = unknown.internal(truth[name])
    return u


def test_nothing_is_begun_where_no_rotor_is_free_or_nothing_else_frees_it(base, soft):
    assert kindred([base], [single("detent_torque")], map) == []
    assert kindred([base, soft], [single("stepper_compliance"), single("backlash")], map) == []


def test_a_field_alone_is_begun_where_detents_that_do_nothing_ended():
    """Its own search may have ended nats away: detents of no torque were named in its place."""
    field = {"holding_torque": 0.1, "damping": 1e-3}
    truth = with_effects(machine("light_bench"), EffectUse("stepper_compliance", "motors", field))
    seen = problem(record(truth, rich_motion(), noise=NOISE, tracker=4), machine("light_bench"),
                   std=NOISE)  # fmt: skip
    base = settle(fitted(seen))
    detents = replace(seen, hypothesis=single("detent_torque"))
    start = planted(detents, TRUTH | field | {"torque": 5e-4})
    stuck = entry_of(base, settle(minimise(detents, start, 15)))
    singles = [single("detent_torque"), single("stepper_compliance")]
    first, second = with_kindred(base, [stuck], singles, map)
    assert first.hypothesis.label == "stepper_compliance at motors"
    assert second is stuck
    assert first.gain > stuck.gain > 30
    assert first.fit.value("stepper_compliance.motors.holding_torque") == pytest.approx(0.1, 0.2)


def test_entries_stay_where_nothing_is_named(base):
    assert with_kindred(base, [], [single("detent_torque")], map) == []
