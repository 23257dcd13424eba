"""The generated pages are what their generator would write now."""

import pytest

from benchmarks.pages import PAGE, PLOTS, page, signature, stale
from corexy_fmi.effects import catalogue


@pytest.fixture(scope="module")
def text():
    return page({name: signature(effect) for name, effect in catalogue().items()})


def test_effects_page_is_fresh(text):
    assert stale(text) == []


def test_a_stale_page_and_a_lost_plot_are_told(text, tmp_path):
    changed = tmp_path / "effects.md"
    changed.write_text(PAGE.read_text(encoding="utf-8").replace("backlash", "slack", 1))
    assert stale(text, changed, PLOTS) == ["effects.md"]
    assert stale(text, PAGE, tmp_path) == [f"{name}.png" for name in catalogue()]


def test_every_effect_shows(text):
    """No signature is a flat line: the page would show a picture of nothing."""
    for effect in catalogue().values():
        assert abs(signature(effect).change).max() > 1.0, effect.name
