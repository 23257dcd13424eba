"""What strikes at a time of its own is found anew beside a second cause."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.fitting.fit import minimise, settle
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming import retimed as again
from corexy_fmi.engine.naming.retimed import retimed
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

STRUCK, AWAY = 2.0, 1.0  # [s]: when a step is lost, where the fit begins
LOST = EffectUse("missed_steps", "motor1", {"steps": -1.0, "time": STRUCK, "duration": 0.01})
TURNED = EffectUse("sensor_rotation", "sensor", {"angle": 0.003})
TIME, STEPS = "missed_steps.{}.time@train.csv", "missed_steps.{}.steps@train.csv"


@pytest.fixture(scope="module")
def shown():
    return record(with_effects(machine(), LOST, TURNED), rich_motion())


def stuck(shown, motor):
    """Both causes, the step at a motor and where no step was lost."""
    chosen = problem(shown, machine(), [("missed_steps", motor), ("sensor_rotation", "sensor")])
    start, k = np.zeros(chosen.size), chosen.keys.index(TIME.format(motor))
    start[k] = chosen.unknowns[k].internal(AWAY)
    return settle(minimise(chosen, start))


@pytest.mark.parametrize("motor", ["motor1", "motor2"])
def test_the_time_and_the_motor_are_found_anew(shown, motor):
    layout = bundled_layout()
    places = [Hypothesis((layout.find("missed_steps", m),)) for m in ("motor1", "motor2")]
    begun = stuck(shown, motor)
    assert abs(begun.value(TIME.format(motor)) - STRUCK) > 0.5
    end = retimed(begun, places, map)
    assert end.value(TIME.format("motor1")) == pytest.approx(STRUCK, abs=0.03)
    assert end.value(STEPS.format("motor1")) == pytest.approx(-1.0, abs=0.1)


def test_a_pair_stays_as_it_is_where_the_other_cause_alone_breaks_down(shown, monkeypatch):
    begun = stuck(shown, "motor1")
    broken = replace(begun, cost=np.inf)
    monkeypatch.setattr(again, "minimise", lambda problem, u, iterations: broken)
    assert retimed(begun, [], map) is begun
