"""E of a concealed cause: what stays of it when everything else is fitted without it."""

from dataclasses import replace

import numpy as np
import pytest
from strange_kit import short_recordings

from benchmarks.shop.stage import Faults
from benchmarks.strange import draw, evidence, page
from benchmarks.strange.cause import About, Cause
from benchmarks.strange.drive_causes import SENSORS
from benchmarks.strange.running import Acts
from benchmarks.strange.sizes import Sized

SMALL = 15  # a seed


@pytest.fixture(scope="module")
def case():
    with short_recordings():
        drawn = draw.draw(SMALL)
    return replace(drawn, sensor=replace(drawn.sensor, offsets=np.zeros((3, 2))))


def cause_of(name, case, among):
    """A cause of this name at any place."""
    about = About(case.machine, case.motions)
    found = (d(np.random.default_rng(n), about) for n in range(9) for d in among)
    return next(c for c in found if c.name == name)


def alone(name, size, case, among):
    return replace(case, found=(Sized(cause_of(name, case, among), size, 1.0),))


def test_columns_take_away_what_they_span():
    random = np.random.default_rng(0)
    columns, change = random.standard_normal((50, 3)), random.standard_normal(50)
    rest = change - columns @ np.linalg.lstsq(columns, change, rcond=None)[0]
    assert evidence.left(change, columns) == pytest.approx(rest @ rest, rel=1e-3)
    assert evidence.left(columns @ [1.0, 2.0, 3.0], columns) == pytest.approx(14e-4, rel=0.01)
    assert evidence.left(change, np.zeros((50, 2))) == pytest.approx(change @ change)


def test_a_number_that_does_next_to_nothing_takes_nothing_away():
    """It would have to change by far more than a linear view of it holds."""
    change = np.full(50, 30.0)
    assert evidence.left(change, np.full((50, 1), 1e-4)) > 0.9 * change @ change


def stiffer(case):
    """All sections of both belts a little stiffer, which is another number of the machine."""
    acts = lambda size: Acts(lambda n, t: Faults(sections=(1 + size,) * 12))  # noqa: E731
    cause = Cause("stiffer", "belts", (0.0, 1.0), lambda s: {}, acts)
    return replace(case, found=(Sized(cause, 0.03, 1.0),))


def test_what_a_number_of_the_machine_is_has_none(case):
    assert evidence.evidence(stiffer(case))[0] < 1e-3 * whole(stiffer(case))


def test_what_no_number_imitates_keeps_most(case):
    turned = alone("sensor_rotation", 1e-3, case, SENSORS)
    assert 0.2 * whole(turned) < evidence.evidence(turned)[0] < whole(turned)


def whole(case):
    """E0 of the only cause."""
    found = list(case.found)
    with_it, without = (evidence._seen(case, draw.acts_of(f), {}) for f in (found, []))
    pairs = zip(with_it, without, strict=True)
    return sum((case.sensor.whitened(a - b) ** 2).sum() for a, b in pairs)


def test_a_cause_takes_nothing_that_its_twin_of_another_size_explains(case):
    """Beside itself, whose size is free, a cause has no evidence of its own."""
    one = Sized(cause_of("sensor_rotation", case, SENSORS), 1e-3, 1.0)
    both = evidence.evidence(replace(case, found=(one, one)))
    single = evidence.evidence(replace(case, found=(one,)))
    assert single[0] > 1.0
    assert max(both) < 0.05 * single[0]


def test_a_table_counts_by_the_least_evidence():
    play = {"effect": "backlash", "location": "motor1"}
    truth = {"effect": "two", "E0": 5e3}
    truth["effects"] = [play, {"effect": "axis_skew", "location": "sensor"}]
    told = {"verdict": "explained", "coordinate": "motor1"}
    told["effects"] = [{"name": "backlash", "location": "motor1"}]
    entries = [{"name": name, "number": 1000, "truth": truth, "told": told} for name in "ab"]
    known = {"a": [5e3, 2e3], "b": [5e3, 10.0]}
    assert page.by_evidence(entries, {"a": known["a"]}) == ""  # not of all
    text = page.by_evidence(entries, known)
    rows = [line.split(" | ")[1:3] for line in text.splitlines()[2:]]
    assert [r[0] for r in rows] == ["1000 and more", "below 300"]
    assert "0/1" in rows[0][1]
