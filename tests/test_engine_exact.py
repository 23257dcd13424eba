"""A replay without any noise: nothing is missing from the model that made it."""

import pytest
from engine_kit import fitted, machine, other_motion, problem, record, short_motion

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.judging.axes import uneven


@pytest.mark.parametrize("name", ["yin2018", "yin2018_dc"])
def test_the_models_own_response_lacks_nothing(name):
    chosen = machine(name)
    made = record(chosen, short_motion(), noise=0.0)
    kept = record(chosen, other_motion(), "judge.csv", noise=0.0)
    document = diagnose([made], [kept], chosen).document
    assert document["verdict"] == "nothing_missing"
    assert document["effects"] == []
    assert document["heldout"]["rms_retuned"] == pytest.approx(0.0, abs=1e-9)


def test_axes_without_errors_are_even():
    chosen = machine()
    made = record(chosen, short_motion(), noise=0.0)
    fit = fitted(problem(made, chosen), 0)
    assert uneven(fit) == ("", "")
