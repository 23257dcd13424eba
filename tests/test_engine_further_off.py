"""A machine file that is off by a factor explains as much as a cause that stands in for it."""

from types import SimpleNamespace

import numpy as np
import pytest
from engine_kit import (
    BACKLASH,
    NOISE,
    fitted,
    machine,
    other_motion,
    problem,
    record,
    rich_motion,
    with_effects,
)

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.starts import astray
from corexy_fmi.engine.judging import further_off
from corexy_fmi.engine.judging.further_off import (
    FAR,
    STRANGE,
    another_machine,
    beside_retuned,
    explains_as_much,
)
from corexy_fmi.engine.judging.verdict import Verdict
from corexy_fmi.engine.naming.entries import entry_of
from corexy_fmi.kernel.layout import bundled_layout

WRONG = {"carriage_viscous_friction": 0.2, "bridge_viscous_friction": 0.2}  # of the truth's
LAG = ("sensor_lag", "sensor")


def competing(place, *uses, **off):
    """What retuning and a cause at a place make of a recording, by a machine file that is off."""
    file = with_effects(machine(), **off)
    shown = record(with_effects(machine(), *uses), rich_motion(), noise=NOISE)
    base = retune(bundled_layout(), file, problem(shown, file).runs)
    asked = problem(shown, file, [place])
    return base, entry_of(base, fitted(asked, 20))


def test_a_file_that_is_off_by_a_factor_is_as_good_as_a_lag():
    base, entry = competing(LAG, **WRONG)
    assert astray(base) > FAR
    assert explains_as_much(base, entry)


def test_no_file_explains_play_as_well_as_play():
    base, entry = competing(("backlash", "motor1"), BACKLASH, **WRONG)
    assert astray(base) > FAR
    assert entry.gain > 100
    assert not explains_as_much(base, entry)


def test_a_file_that_retuning_keeps_to_is_not_doubted():
    base, entry = competing(LAG)
    assert not explains_as_much(base, entry)


def entry(law=None):
    key = (("sensor_lag", "sensor"),)
    return SimpleNamespace(hypothesis=SimpleNamespace(law=law, key=key))


KEY, OTHER = (("sensor_lag", "sensor"),), (("racking", "bridge"),)
CASES = [
    (Verdict("explained", entry()), "ambiguous", ((KEY, ()),)),
    (Verdict("ambiguous", entry(), ((KEY, OTHER),)), "ambiguous", ((KEY, OTHER, ()),)),
    (Verdict("ambiguous", entry(), ((KEY, ()),)), "ambiguous", ((KEY, ()),)),
    (Verdict("unexplained", entry(law=1)), "unexplained", ()),
    (Verdict("unexplained", None, refuted=entry()), "nothing_missing", ()),
    (Verdict("nothing_missing", None), "nothing_missing", ()),
]


@pytest.mark.parametrize(("verdict", "word", "classes"), CASES)
def test_what_is_said_then(monkeypatch, verdict, word, classes):
    monkeypatch.setattr(further_off, "explains_as_much", lambda retuned, best: True)
    found = beside_retuned(verdict, SimpleNamespace(retuned=None))
    assert (found.word, found.classes) == (word, classes)
    monkeypatch.setattr(further_off, "explains_as_much", lambda retuned, best: False)
    assert beside_retuned(verdict, SimpleNamespace(retuned=None)) is verdict


@pytest.mark.parametrize(("far", "word"), [(4, "explained"), (5, "unexplained")])
def test_a_cause_beside_which_most_of_the_file_is_wrong_is_none(monkeypatch, far, word):
    """Two guessed frictions may be far off; of another machine's file most is."""
    off = np.where(np.arange(8) < far, 1.1, 0.9) * FAR
    monkeypatch.setattr(further_off, "pulls", lambda fit: off)
    cause = SimpleNamespace(fit=None, hypothesis=SimpleNamespace(label="backlash"))
    found = another_machine(Verdict("explained", cause))
    assert found.word == word
    assert STRANGE == 0.5
    told = "beside backlash, 5 of 8 nominal parameters are beyond 3 sigma: "
    assert word == "explained" or found.reason.startswith(told)


def test_the_file_of_another_machine_makes_no_cause_sure():
    truth = machine("light_bench")
    files = [
        [record(truth, motion, name, seed=n)]
        for n, (motion, name) in enumerate(
            ((rich_motion(), "train.csv"), (other_motion(), "judge.csv"))
        )
    ]
    document = diagnose(*files, machine("yin2018"), jobs=2).document
    assert document["verdict"] not in ("explained", "ambiguous")
