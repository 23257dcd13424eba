"""Recordings of a workshop: what a verdict is worth, results on the disk, the page."""

import pytest

from benchmarks.shop import __main__ as shop
from benchmarks.shop import case as cases_of
from benchmarks.shop import grade, page, store
from benchmarks.shop.cases import CASES

PLAY, DELAY = ("backlash", "motor1"), ("sensor_delay", "sensor")
NULL, OUTSIDE = cases_of.nothing(), cases_of.outside("belts")
CLASS = [[{"name": n, "location": at} for n, at in (PLAY, DELAY)]]


def told(verdict, *effects, place=None, classes=()):
    named = [{"name": name, "location": where} for name, where in effects]
    return {"verdict": verdict, "effects": named, "coordinate": place,
            "ambiguous_between": classes, "ambiguous_sets": []}  # fmt: skip


@pytest.mark.parametrize(
    ("truth", "said", "value", "allowed"),
    [
        (NULL, told("nothing_missing"), grade.RIGHT, True),
        (NULL, told("unexplained", place="x"), grade.ALARM, False),
        (NULL, told("ambiguous", PLAY, classes=CLASS), grade.ALARM, False),
        (NULL, told("explained", PLAY), grade.WRONG, False),
        (NULL, told("refused"), grade.ABSTAINED, False),
        (OUTSIDE, told("explained", PLAY, place="belts"), grade.WRONG, False),
        (OUTSIDE, told("unexplained", place="belts"), grade.PLACE, True),
        (OUTSIDE, told("ambiguous", PLAY, place="x", classes=CLASS), grade.ABSTAINED, True),
        (OUTSIDE, told("nothing_missing"), grade.MISSED, False),
        (cases_of.named("motor1", [PLAY]), told("explained", PLAY), grade.RIGHT, True),
        (cases_of.named("motor1", [PLAY]), told("explained", PLAY, DELAY), grade.WRONG, False),
        (cases_of.named("motor1", [PLAY, DELAY]), told("explained", PLAY), grade.WRONG, False),
        (cases_of.named("motor1", [PLAY]), told("ambiguous", DELAY, classes=CLASS), grade.RIGHT,
         True),
        (cases_of.named("motor1", [PLAY], also="unexplained"),
         told("unexplained", place="motor1"), grade.PLACE, True),
        (cases_of.named("motor1", [PLAY]), told("unexplained", place="motor1"), grade.PLACE,
         False),
    ],
)  # fmt: skip
def test_grades(truth, said, value, allowed):
    assert grade.grade(truth, said) == value
    assert grade.as_allowed(truth, said) == allowed


def test_a_partial_sum_says_so():
    line = grade.summary([(NULL, told("nothing_missing")), (OUTSIDE, told("explained", PLAY))], 9)
    assert line.startswith("2 of 9 cases run so far: right 1, wrong and sure 1.")
    assert "Wrong and sure: 1/2 = 50.0 % [9.5, 90.5]" in line
    assert grade.summary([(NULL, told("nothing_missing"))], 1).startswith("All 1 cases: right 1.")


def test_the_page_is_fresh():
    text = page.PAGE.read_text(encoding="utf-8")
    assert page.rendered(store.stored(), text) == text


@pytest.fixture
def aside(tmp_path, monkeypatch):
    """Results and page in a folder of their own; the engine says nothing_missing at once."""
    (tmp_path / "shop.md").write_text(f"head\n\n{page.BEGIN}\nold\n{page.END}\ntail\n")
    monkeypatch.setattr(store, "FOLDER", tmp_path)
    monkeypatch.setattr(page, "PAGE", tmp_path / "shop.md")
    monkeypatch.setattr(shop, "told", lambda case, hears: told("nothing_missing"))
    monkeypatch.setattr(shop, "commit", lambda: "abc")
    return tmp_path


def call(monkeypatch, *words):
    monkeypatch.setattr("sys.argv", ["shop", *words])
    return shop.main()


def test_what_is_there_is_not_run_again_unless_asked(aside, monkeypatch):
    names = ("null_yin", "lens", "bump")
    assert call(monkeypatch, "--only", *names, "--shard", "0/2") == 0
    assert [e["name"] for e in store.read(aside / "shop.0.jsonl")] == ["null_yin", "bump"]
    assert call(monkeypatch, "--only", *names) == 0
    assert [e["name"] for e in store.read(aside / "shop.jsonl")] == ["lens"]
    monkeypatch.setattr(shop, "commit", lambda: "later")
    call(monkeypatch, "--only", "lens", "--again")
    (entry,) = store.read(aside / "shop.jsonl")
    assert entry["commit"] == "later"
    text = (aside / "shop.md").read_text()
    assert f"3 of {len(CASES)} cases run so far: right 1, missed 2." in text
    assert text.startswith("head\n")
    assert text.endswith(f"{page.END}\ntail\n")


def test_an_interrupt_leaves_whole_results(aside, monkeypatch):
    def stopped(case, hears):
        if case.name == "lens":
            raise KeyboardInterrupt
        return told("nothing_missing")

    monkeypatch.setattr(shop, "told", stopped)
    assert call(monkeypatch, "--only", "null_yin", "lens", "bump") == 130
    assert [e["name"] for e in store.stored()] == ["null_yin"]
    assert f"1 of {len(CASES)} cases" in (aside / "shop.md").read_text()
    assert not list(aside.glob("*.new"))
