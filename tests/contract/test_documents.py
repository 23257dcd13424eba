"""The validator itself: it passes the contract's example and sees every kind of breach."""

import pytest

from tests.contract.documents import ROOT, problems
from tests.contract.example import example


def test_the_example_of_the_contract_is_right():
    assert problems(example()) == []


@pytest.mark.parametrize("key", ROOT)
def test_every_key_is_asked_for(key):
    document = example()
    del document[key]
    assert problems(document) == [f"{key}: missing"]


BREACHES = {
    "verdict": lambda d: d.update(verdict="perhaps"),
    "effects[0].probability": lambda d: d["effects"][0].update(probability=1.2),
    "effects[0].remedy": lambda d: d["effects"][0].update(remedy=None),
    "effects[0].parameters.gap.ci95": lambda d: d["effects"][0]["parameters"]["gap"].update(
        ci95=[2, 1]
    ),
    "located.coordinate": lambda d: d["located"].update(coordinate="motor3"),
    "located.state": lambda d: d["located"].update(state="angle"),
    "located.time": lambda d: d["located"]["time"].append(["other.csv", 0, 1, 1]),
    "fit[0].role": lambda d: d["fit"][0].update(role="test"),
    "fit[0].rms_retuned": lambda d: d["fit"][0].update(rms_retuned=float("nan")),
    "heldout.excess_removed": lambda d: d["heldout"].update(excess_removed=0.5),
    "retuned.carriage_mass.pull": lambda d: d["retuned"]["carriage_mass"].update(pull=True),
    "not_excluded[0].upper95": lambda d: d["not_excluded"][0].update(upper95="small"),
    "ambiguous": lambda d: d.update(verdict="ambiguous"),
    "unexplained": lambda d: d.update(verdict="unexplained"),
    "nothing_missing": lambda d: d.update(verdict="nothing_missing"),
    "explained": lambda d: d.update(effects=[]),
    "next_experiment.why": lambda d: d.update(next_experiment={"program": "a"}),
}


@pytest.mark.parametrize(("place", "breach"), BREACHES.items(), ids=BREACHES)
def test_breaches_are_seen(place, breach):
    document = example()
    breach(document)
    assert any(problem.startswith(place) for problem in problems(document))
