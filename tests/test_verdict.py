"""The screen of a diagnosis: verdict, cause, proof, and brackets that stay brackets."""

import pytest

from corexy_fmi.commands.verdict import show_verdict
from tests.contract.example import example


def shown(capsys, **changes):
    show_verdict({**example(), **changes})
    return " ".join(capsys.readouterr().out.split())


def test_cause_place_size_and_remedy(capsys):
    screen = shown(capsys)
    for word in ("explained", "backlash", "motor1", "0.998", "gap = 0.021 rad", "set screw"):
        assert word in screen


def test_a_number_that_data_do_not_tell_is_not_printed(capsys):
    (effect,) = example()["effects"]
    grip = {"value": 0.638, "unit": "N m", "ci95": [1e-5, 1.0], "determined": False}
    screen = shown(
        capsys, effects=[{**effect, "parameters": {**effect["parameters"], "grip": grip}}]
    )
    assert "gap = 0.021 rad" in screen
    assert "grip = undetermined" in screen
    assert "0.638" not in screen


def test_held_out_proof(capsys):
    screen = shown(capsys)
    for word in ("rms_nominal", "0.0001", "rms_explained", "2.1e-05", "96.8%"):
        assert word in screen


def test_weak_proof_and_an_assumed_machine_are_said(capsys):
    heldout = {**example()["heldout"], "weak": True, "excess_removed": None}
    screen = shown(capsys, heldout=heldout, machine_assumed=True)
    assert "weak" in screen
    assert "none" in screen
    assert "a surrogate was assumed" in screen


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        ("nothing_missing", "nothing missing"),
        ("unexplained", "no catalogued effect"),
        ("ambiguous", "more than one cause"),
    ],
)
def test_every_verdict_has_its_sentence(capsys, verdict, words):
    assert words in shown(capsys, verdict=verdict, effects=[])


def test_a_cause_whose_size_is_not_sure_stands_against_nothing(capsys):
    cause = {"name": "backlash", "location": "motor1"}
    effect = cause | {"size_is_sure": False, "probability": 0.97, "parameters": {}}
    screen = shown(capsys, verdict="ambiguous", ambiguous_between=[[cause]], effects=[effect])
    assert "its size is not" in screen
    assert "backlash" in screen
    assert "told apart" not in screen


def test_what_cannot_be_told_apart(capsys):
    group = [{"name": name, "location": "sensor"} for name in ("sensor_delay", "sensor_lag")]
    screen = shown(capsys, verdict="ambiguous", ambiguous_between=[group])
    assert "sensor_delay at sensor or sensor_lag at sensor" in screen


def test_what_acts_together_is_told_together(capsys):
    delay, lag, skew = (
        {"name": f"sensor_{n}", "location": "sensor"} for n in ("delay", "lag", "x")
    )
    equal = {"ambiguous_between": [[delay, lag]], "ambiguous_sets": [[[delay, skew], [lag, skew]]]}
    screen = " ".join(shown(capsys, verdict="ambiguous", **equal).split())
    assert "sensor_delay at sensor with sensor_x at sensor or sensor_lag at sensor with" in screen


def test_brackets_are_no_markup(capsys):
    document = example()
    document["effects"][0]["name"] = "[red]x[/red]"
    assert "[red]x[/red]" in shown(capsys, effects=document["effects"])
