"""What the competition and the data kept back allow to be said, case by case."""

from types import SimpleNamespace

import pytest

from corexy_fmi.engine.judging.doubt import still_loud
from corexy_fmi.engine.judging.verdict import SURE, Verdict, decide
from corexy_fmi.engine.naming.entries import CEILING, Competition


def entry(name, gain, law=None):
    hypothesis = SimpleNamespace(key=((name, "x"),), law=law, uses=() if law else (1,), label=name)
    return SimpleNamespace(hypothesis=hypothesis, gain=gain)


def competition(chance, gain, law=None):
    """A winner with its probability, and one rival that has the rest."""
    entries = (entry("first", gain, law), entry("second", gain - 1))
    return SimpleNamespace(best=entries[0], entries=entries, probability=(chance, 1 - chance))


def proof(*gains, retuned=1.5, explained=1.0, contrasts=None, moved=(1.5, 1.5)):
    """Held-out runs with these gains; those with and without differ by as much unless told.
    ``moved``: rms retuned and explained, as far as training lets parameters move.
    """
    rms = {"retuned": retuned, "explained": explained}
    return SimpleNamespace(
        gains=lambda role: list(gains),
        pooled=lambda state, role: rms[state],
        within_training=lambda state, role: moved[state == "explained"],
        contrasts=lambda role: [30.0 for _ in gains] if contrasts is None else list(contrasts),
    )


SURELY, TIED = 0.99, 0.6
CASES = [
    (SURELY, 500.0, proof(30.0), "explained"),
    (SURELY, 500.0, proof(), "explained"),
    (SURELY, 500.0, proof(30.0, -0.5), "unexplained"),  # a gain on every file is asked
    (SURELY, 500.0, proof(-25.0), "unexplained"),
    (SURELY, 30.0, proof(-25.0), "nothing_missing"),
    (SURELY, 500.0, proof(30.0, -0.5, contrasts=(30.0, 0.4)), "explained"),  # one cannot judge
    (SURELY, 500.0, proof(30.0, -5.0, contrasts=(30.0, 0.4)), "unexplained"),
    (SURELY, 500.0, proof(700.0, -1.6, contrasts=(750.0, 11.2)), "explained"),  # by chance, one
    (SURELY, 500.0, proof(700.0, -1.6, contrasts=(750.0, 25.0)), "unexplained"),
    (SURELY, 500.0, proof(300.0, -1.6, contrasts=(750.0, 11.2)), "unexplained"),
    (SURELY, 500.0, proof(700.0, -2.1, contrasts=(750.0, 11.2)), "unexplained"),
    (SURELY, 70.0, proof(0.7, contrasts=(0.8,)), "explained"),  # nor can the only one
    (SURELY, 70.0, proof(-0.3, contrasts=(0.8,)), "ambiguous"),  # it gains nothing
    (SURELY, 70.0, proof(-3.3, contrasts=(0.1,)), "ambiguous"),  # fits of the same end apart
    (SURELY, 70.0, proof(-3.3), "unexplained"),
    (SURELY, 70.0, proof(-5.0, contrasts=(0.8,)), "unexplained"),
    (SURELY, 70.0, proof(0.8, contrasts=(13.7,)), "ambiguous"),  # they show little of it, too
    (SURELY, 70.0, proof(0.8, contrasts=(30.0,)), "unexplained"),  # they show it, otherwise
    (SURELY, 70.0, proof(-0.1, contrasts=(13.7,)), "unexplained"),
    (SURELY, 70.0, proof(0.8, retuned=1.2, explained=1.15, contrasts=(13.7,)), "unexplained"),
    (SURELY, 30.0, proof(0.8, contrasts=(13.7,)), "nothing_missing"),
    (SURELY, 30.0, proof(0.7, contrasts=(0.8,)), "nothing_missing"),  # a false alarm, as likely
    (SURELY, 500.0, proof(30.0, retuned=0.87, explained=1.0), "unexplained"),  # rms has grown
    (SURELY, 500.0, proof(30.0, retuned=0.99, explained=1.0), "explained"),
    (TIED, 500.0, proof(30.0), "ambiguous"),
    (TIED, 500.0, proof(0.5), "ambiguous"),  # the data kept back show little of it
    (TIED, 500.0, proof(0.5, retuned=1.54, explained=1.38), "unexplained"),  # most of it stays
    (TIED, 500.0, proof(0.5, retuned=1.54, explained=1.2), "ambiguous"),
    (TIED, 500.0, proof(0.5, retuned=1.54, explained=1.38, contrasts=(0.8,)), "ambiguous"),
    (TIED, 500.0, proof(-25.0), "unexplained"),
    (TIED, 30.0, proof(0.5), "nothing_missing"),
]


@pytest.mark.parametrize(("chance", "gain", "kept", "word"), CASES)
def test_the_word(chance, gain, kept, word):
    assert TIED < SURE < SURELY
    assert decide(competition(chance, gain), kept).word == word


@pytest.mark.parametrize(
    ("chance", "gain", "kept", "word"),
    [
        (SURELY, 500.0, {"moved": (20.0, 1.05)}, "ambiguous"),
        (SURELY, 500.0, {"moved": (20.0, 12.0)}, "ambiguous"),  # half of the excess goes
        (SURELY, 500.0, {"moved": (20.0, 18.0)}, "unexplained"),
        (SURELY, 500.0, {"moved": (float("nan"), float("nan"))}, "unexplained"),  # not foretold
        (SURELY, 500.0, {"moved": (20.0, 1.05), "explained": 1.0}, "explained"),
        (SURELY, 30.0, {"moved": (20.0, 1.05)}, "nothing_missing"),  # a false alarm, as likely
        (TIED, 500.0, {"moved": (20.0, 1.05), "explained": 30.0}, "unexplained"),
        (TIED, 500.0, {"moved": (20.0, 18.0)}, "unexplained"),
    ],
)
def test_a_sure_cause_of_another_size_is_no_explanation(chance, gain, kept, word):
    """A supply's limit known to 1 % by training, and to 1e-4 by what was kept back."""
    found = decide(
        competition(chance, gain), proof(90.0, retuned=25.0, **{"explained": 22.5} | kept)
    )
    assert found.word == word
    assert found.unsized == (word == "ambiguous")
    assert found.classes == (((("first", "x"),),),) * found.unsized


@pytest.mark.parametrize("gains", [(90.0, -0.5), (-25.0,), (1.5,)])
def test_another_size_must_gain_on_every_recording(gains):
    kept = proof(*gains, retuned=25.0, explained=22.5, moved=(20.0, 1.05))
    assert decide(competition(SURELY, 500.0), kept).word == "unexplained"


@pytest.mark.parametrize(("gain", "word"), [(-1.0, "unexplained"), (-25.0, "unexplained")])
def test_a_law_has_no_name_to_lose(gain, word):
    found = decide(competition(SURELY, 500.0, law=object()), proof(gain))
    assert found.word == word
    assert (found.entry is None) == (gain < -2)


def test_no_probability_is_above_what_sure_causes_turned_out_to_be():
    """A member of every entry has all shares, whose sum may round to more than one."""
    chances = (0.5, 0.5000000000000002)
    assert sum(chances) > 1
    every = Competition(None, tuple(entry("same", 9.0) for _ in chances), chances, 0.0)
    assert every.share(("same", "x")) == CEILING
    assert every.share(("other", "x")) == 0.0


@pytest.mark.parametrize(("weak", "word"), [(False, "explained"), (True, "ambiguous")])
def test_a_silent_end_of_the_same_recording_confirms_nothing(weak, word):
    found = decide(competition(SURELY, 70.0), proof(0.3, contrasts=(0.8,)), weak)
    assert found.word == word
    assert found.classes == ((found.entry.hypothesis.key, ()),) * weak


@pytest.mark.parametrize(("gain", "contrast"), [(-0.3, 0.8), (0.8, 13.7)])
def test_an_effect_that_data_kept_back_hardly_show_stands_beside_retuned_parameters(gain, contrast):
    found = decide(competition(SURELY, 70.0), proof(gain, contrasts=(contrast,)))
    assert found.classes == (((("first", "x"),), ()),)
    assert found.unseen


@pytest.mark.parametrize(
    ("word", "rms", "left"),
    [
        ("explained", (2.0, 1.4), "unexplained"),
        ("explained", (20.0, 1.4), "explained"),  # next to all of it is gone
        ("explained", (1.5, 1.2), "explained"),
        ("ambiguous", (2.0, 1.4), "ambiguous"),
        ("explained", (float("nan"),) * 2, "explained"),  # nothing was kept back
    ],
)
def test_what_is_loud_on_data_kept_back_is_not_explained(word, rms, left):
    given = Verdict(word, entry("backlash", 900.0))
    found = still_loud(given, proof(30.0, retuned=rms[0], explained=rms[1]))
    assert found.word == left
    assert ("still 1.4 times the noise" in found.reason) == (left != word)
