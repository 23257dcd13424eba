"""What a report is made of: equations, thinned curves, numbers and places in words."""

from dataclasses import replace

import numpy as np
import pytest

from corexy_fmi.effects import catalogue
from corexy_fmi.report import render_report
from corexy_fmi.report.charts import marked_parts
from corexy_fmi.report.decimate import envelope, log_bins, outline, rms_per_cell
from corexy_fmi.report.equation import typeset
from corexy_fmi.report.plane import _path_scale
from corexy_fmi.report.quantities import number, percent, prefix_for, quantity, with_interval
from corexy_fmi.report.tables import not_excluded, parameters, sites, words
from corexy_fmi.report.words import cause, place
from tests.report_cases import NOISE, make_document, make_evidence, make_trace


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_equation_of_every_effect_can_be_set(name):
    assert typeset(catalogue()[name].equation).startswith("<svg")


@pytest.mark.parametrize("latex", ["", "$", r"\unknown{x}", r"\frac{", "x" * 5000, "{" * 900, "é"])
def test_what_is_no_equation_falls_back_to_text(latex):
    assert typeset(latex).startswith("<code")


def test_envelope_keeps_every_peak():
    values = np.random.default_rng(1).standard_normal(10_007)
    values[[3, 9_999]] = np.nan
    found = envelope(np.arange(10_007.0), values, 100)
    assert len(found.time) == 100
    assert found.merged
    assert found.high.max() == np.nanmax(values)
    assert found.low.min() == np.nanmin(values)
    assert not envelope(np.arange(50.0), np.arange(50.0), 100).merged


def test_outline_draws_each_loop_once_and_stays_on_the_path():
    turn = np.linspace(0, 2 * np.pi * 50, 200_001)
    x, y = outline(np.cos(turn), np.sin(turn))
    assert len(x) < 9000
    known = np.isfinite(x)
    assert np.abs(np.hypot(x, y)[known] - 1).max() < 1e-12
    assert np.abs(np.diff(x)[known[1:] & known[:-1]]).max() < 0.02
    drawn = np.unwrap(np.sort(np.arctan2(y[known], x[known])))
    assert np.diff(drawn).max() < 0.01


def test_noisy_outline_gives_up_detail_before_size():
    noise = np.random.default_rng(2).standard_normal((2, 50_000))
    assert len(outline(*noise)[0]) < 3 * 6000


def test_cells_and_bins_average_power():
    x, y, size = rms_per_cell(
        np.array([0, 0, 1.0]), np.array([0, 0, 1.0]), np.array([3.0, 4.0, 1.0])
    )
    assert sorted(size) == pytest.approx([1.0, np.sqrt(12.5)])
    assert (x.max(), y.max()) == (1.0, 1.0)
    frequency = np.arange(5001.0)
    middle, density = log_bins(frequency, np.full(5001, 2.0))
    assert len(middle) <= 300
    assert density == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (2.04e-5, "m", "20.4 µm"),
        (9.996e-4, "m", "1.00 mm"),
        (5.4e-6, "kg m^2", "5.40 \u00d7 10⁻⁶ kg m²"),
        (-0.3, "m/s^2", "\u2212300 mm/s²"),
        (12345, "N/m", "12.3 kN/m"),
        (1.8, "1", "1.80"),
        (0, "m", "0 m"),
        (float("nan"), "m", "\u2013"),
    ],
)
def test_quantities_read_well(value, unit, text):
    assert quantity(value, unit).replace("\u202f", " ") == text


def test_intervals_and_shares_keep_the_digits_that_matter():
    told = with_interval(0.0210234, [0.0210230, 0.0210238], "rad")
    assert [t.replace("\u202f", " ") for t in told] == ["21.0234 mrad", "21.0230 to 21.0238 mrad"]
    assert with_interval(1.0, None, "m")[1] == "\u2013"
    assert number(123456).startswith("1.23")
    shares = [percent(v).replace("\u202f", " ") for v in (0.998, 0.99999, 1.0, 1e-5, 0.31, 0.974)]
    assert shares == ["99.8 %", "> 99.9 %", "100 %", "< 0.1 %", "31 %", "97.4 %"]


def test_a_number_that_data_do_not_tell_is_no_value():
    document = make_document("explained")
    estimates = document["effects"][0]["parameters"]
    name = next(iter(estimates))
    told = {row[1]: row[2:] for row in parameters(document).rows}
    estimates[name] |= {"determined": False}
    (value, interval) = next(r[2:] for r in parameters(document).rows if r[1] == words(name))
    assert value == "undetermined"
    assert interval == f"{told[words(name)][1]}: its whole range"


def test_places_read_well():
    assert place("pulley7") == "at pulley 7"
    assert place(None) == ""
    assert place("somewhere") == "at somewhere"


def test_places_that_go_without_saying_are_not_said():
    assert cause({"name": "sensor_delay", "location": "sensor"}) == "sensor delay"
    assert cause({"name": "racking", "location": "bridge"}) == "racking at the bridge"


def test_an_unexplained_mismatch_is_marked_where_it_lies_not_where_its_law_acts():
    document = make_document("unexplained")
    document["effects"][0]["location"] = "x"
    document["located"]["coordinate"] = "motor1"
    assert marked_parts(document) == {"motor1"}
    document["located"]["coordinate"] = None
    assert marked_parts(document) == {"x"}
    assert marked_parts(make_document("explained")) == {"motor1"}


def test_bars_of_the_places_stand_under_a_number():
    table = sites(make_document("unexplained"))
    assert len(table.bars) == len(table.rows) > 1
    assert table.headers[1].startswith(">")
    assert all(float(row[1].replace("\N{MINUS SIGN}", "-")) for row in table.rows)


def test_the_bound_of_an_inverse_is_told_as_the_least_of_the_thing_itself():
    soft = {"name": "frame_mode", "location": "frame", "parameter": "1/mass",
            "upper95": 0.125, "unit": "1/(kg)"}  # fmt: skip
    document = make_document("explained") | {"not_excluded": [soft]}
    assert not_excluded(document).rows[0][1:] == (
        "mass",
        "at least 8.00\N{NARROW NO-BREAK SPACE}kg",
    )
    document["not_excluded"] = [soft | {"upper95": 0.0}]
    assert not_excluded(document).rows[0][1] == "1/mass"


def test_a_sure_cause_of_unsure_size_is_told_alone():
    document = make_document("ambiguous")
    document["ambiguous_between"] = [document["ambiguous_between"][0][:1]]
    document["effects"][0]["size_is_sure"] = False
    page = render_report(document, make_evidence("ambiguous", 500))
    assert "was left out of the simulation; how large it is remains open." in page
    assert "keep another recording back" in page
    assert "cannot tell apart" not in page


def test_a_path_along_y_has_units_of_its_own_length():
    trace = make_trace("y.csv", "train")
    seen = {**trace.measured, "x": 2e-8 * trace.measured["x"]}
    scale, unit = _path_scale(replace(trace, measured=seen))
    assert (scale, unit) == prefix_for(float(np.nanmax(np.abs(trace.measured["y"]))), "m")


@pytest.mark.parametrize(
    ("explained", "words"),
    [(0.5, "falls from"), (2.0, "stays at"), (2.2, "grows from")],
)
def test_what_is_kept_back_is_told_as_it_is(explained, words):
    document = make_document("unexplained")
    document["heldout"] |= {"rms_retuned": 2 * NOISE, "rms_explained": explained * NOISE}
    text = render_report(document, make_evidence("unexplained", 500))
    assert f"the mismatch {words}" in text


def test_a_law_without_numbers_is_no_explanation_in_numbers():
    """Where a mismatch has a place and no law, the document names it by a law with no knots."""
    document = make_document("unexplained")
    evidence = make_evidence("unexplained", 500)
    assert "in numbers" not in render_report(document, evidence)
    document["effects"][0] |= {"knots": [0.0, 1.0], "values": [0.0, 1.0]}
    assert "in numbers" in render_report(document, evidence)
