"""The paper's figures and claims: numbers of the specification, equivalences, reproducibility."""

import json
from dataclasses import fields

import numpy as np
import pytest
from kernel_helpers import parameters

from benchmarks import paper as page
from corexy_fmi.errors import InputError
from corexy_fmi.reproduce import fig4 as fig4_module
from corexy_fmi.reproduce import paths
from corexy_fmi.reproduce.claimed import CORE, ORDER, claims
from corexy_fmi.reproduce.claims import JUDGED, PULSE_LIMIT, judge
from corexy_fmi.reproduce.fig3 import fig3
from corexy_fmi.reproduce.fig4 import straight_line
from corexy_fmi.reproduce.measure import RADIUS, _paths, exponents, measure
from corexy_fmi.reproduce.paper import (
    EXPONENTS,
    FLOOR,
    LATER,
    SETS,
    SETTLING,
    SINGLE,
    SPEEDS,
    bundled,
)
from corexy_fmi.reproduce.plant import plant
from corexy_fmi.reproduce.regime import damping
from corexy_fmi.reproduce.result import markdown, write_result
from corexy_fmi.reproduce.sets import (
    RANGES,
    at_radius,
    drawn,
    scaled,
    vectors,
    without_coulomb,
)
from corexy_fmi.reproduce.study import split

QUIET = lambda what, share: None  # noqa: E731


@pytest.fixture(scope="module")
def named():
    return measure([parameters(SETS[name]) for name in ORDER])


@pytest.fixture(scope="module")
def through_fmu():
    with plant(bundled("yin2018")) as stage:
        yield stage


@pytest.mark.parametrize(("model", "turn"), SINGLE, ids="-".join)
def test_single_corners_through_the_fmu_are_the_specifications(through_fmu, model, turn):
    for speed, expected in zip(SPEEDS, SINGLE[model, turn], strict=True):
        error, _ = through_fmu.corner(turn, speed, model)
        assert 1e3 * error == pytest.approx(expected, rel=0.02)


def test_the_lanes_give_what_the_fmu_gives(through_fmu, named):
    for turn in ("x->y", "y->x"):
        for model in ("full", "4-DoF"):
            found = [through_fmu.corner(turn, speed, model)[0] for speed in SPEEDS]
            assert named.error[model, turn][0] == pytest.approx(found, abs=2e-6)
        assert through_fmu.corner(turn, SPEEDS[1], "ideal") == pytest.approx((0, 0), abs=1e-12)


def test_fig3_has_the_specifications_later_corners_and_repeats_itself():
    result = fig3(bundled("yin2018"), 2, QUIET)
    rows = {(r["model"], r["turn"], r["speed [m/s]"]): r for r in result.tables[0].records()}
    for (model, turn), values in LATER.items():
        for speed, expected in zip(SPEEDS, values, strict=True):
            row = rows[model, turn, speed]
            assert row["error, later mean [mm]"] == pytest.approx(expected, rel=0.01)
            assert row["later spread [mm]"] < 0.01 * expected
            assert row["reference, later [mm]"] == expected
    assert rows["ideal", "x->y", SPEEDS[0]]["error, first [mm]"] == 0


def test_fig4_is_written_with_its_label_and_again_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(fig4_module, "ALL_SPEEDS", SPEEDS)
    texts = []
    for name in ("one", "two"):
        result = fig4_module.fig4(bundled("yin2018"), QUIET)
        written = write_result(result, tmp_path / name)
        assert [path.name for path in written] == ["fig4.json", "fig4.md", "fig4.svg"]
        texts.append([path.read_bytes() for path in written])
    assert texts[0] == texts[1]
    for text in texts[0]:
        assert b"surrogate" in text
        assert b"chosen so that" in text
    fits = {(r["turn"], r["line"]): r for r in result.document()["tables"][1]["rows"]}
    assert all(row["r squared"] > 0.999 for row in fits.values())
    for turn, least in (("x->y", 0.1), ("y->x", 0.7)):
        gap, full = (fits[turn, line]["slope [mm per m/s]"] for line in ("full - 4-DoF", "full"))
        assert gap > least * full


def test_claims_hold_on_p1_and_not_on_p0_and_p2(named):
    verdicts = judge(named)
    assert {name: bool(flags[0]) for name, flags in verdicts.items()} == {
        **dict.fromkeys(CORE, True),
        JUDGED[6]: False,
    }
    for claim in "ad":
        assert not verdicts[claim][1:].any()
    over = named.overshoot["y->x"][1:, -1]
    assert (over > 1e-4).all()
    assert (np.abs(named.error["full", "y->x"][1:, -1]) < 1e-6).all()


@pytest.mark.parametrize("group", EXPONENTS)
def test_exponents_of_p1(named, group):
    assert named.exponent[group, "x->y"][0] == pytest.approx(EXPONENTS[group], abs=0.01)


def test_settling_and_floor_of_p1(named):
    for axis, expected in SETTLING.items():
        assert named.settling[axis][0] == pytest.approx(expected, abs=2e-3)
    step = 1e3 * paths.full_step(RADIUS)
    for turn, expected in FLOOR.items():
        assert step * named.pulsed["with", turn][0, -1] == pytest.approx(expected, abs=1e-3)
        assert abs(named.pulsed["without", turn][0, -1]) < 1e-3 < PULSE_LIMIT


@pytest.mark.parametrize(
    ("machine", "x", "y"),
    [("yin2018", 3.5, 1.5), ("light_bench", 0.08, 0.03), ("gt2_printer", 0.033, 0.022)],
)
def test_damping_ratios(machine, x, y):
    found = [damping(parameters(machine), axis) for axis in "xy"]
    assert found == pytest.approx([x, y], rel=0.1)


def test_sets_of_another_radius_share_a_command():
    """x, y of a set on its own pulleys, and of its twin on pulleys of 5 mm."""
    own = drawn(parameters(), 8, 3)
    for p in own[:3]:
        corner, _ = paths.at_speed("x->y", 0.039, p["pulley_radius"])
        shared, _ = paths.at_speed("x->y", 0.039, RADIUS)
        one, other = (
            _paths(c.excitation, vectors([q]))
            for c, q in ((corner, p), (shared, at_radius(p, RADIUS)))
        )
        assert np.abs(one - other).max() < 1e-9


def test_measures_do_not_depend_on_their_block():
    sets = [at_radius(p, RADIUS) for p in drawn(parameters(), 9, 5)]
    whole, alone = measure(sets), measure(sets[8:])
    for field in fields(whole):
        for key, values in getattr(whole, field.name).items():
            one = getattr(alone, field.name)[key][0]
            scale = 1e-6 if field.name not in ("exponent", "settling", "pulsed") else 0.02
            assert values[8] == pytest.approx(one, abs=scale, rel=0.02, nan_ok=True)


def test_draws_lie_in_their_ranges_and_repeat():
    one, two, other = (drawn(parameters(), 200, seed) for seed in (1, 1, 2))
    assert one == two != other
    for name, (low, high) in RANGES.items():
        values = np.array([p[name] for p in one])
        assert low <= values.min() < values.max() <= high
        assert np.median(values) == pytest.approx(np.sqrt(low * high), rel=0.6)


def test_scaling_moves_its_group_only():
    p = parameters()
    twice = scaled(p, "friction", 2.0)
    assert {n for n in p if twice[n] != p[n]} == {n for n in RANGES if n.endswith("friction")}
    assert without_coulomb(p)["pulley_coulomb_friction"] == 0
    assert without_coulomb(p)["pulley_viscous_friction"] == p["pulley_viscous_friction"]


def test_lines_and_exponents_are_exact_on_exact_data():
    speeds = np.array(fig4_module.ALL_SPEEDS)
    assert straight_line(3 * speeds + 0.1) == pytest.approx((3, 0.1, 1))
    factors = (0.5, 1.0, 2.0)
    assert exponents(factors, np.array([[4.0, 2.0, 1.0]])) == pytest.approx([-1])
    assert np.isnan(exponents(factors, np.array([[-1.0, 2.0, 1.0]]))).all()


def test_a_cut_finds_what_decides():
    random = np.random.default_rng(0)
    cause, idle = random.uniform(size=(2, 400))
    found = split("cause", cause, cause > 0.7)
    assert (found.side, found.score) == ("above", 1.0)
    assert found.at == pytest.approx(0.7, abs=0.01)
    assert split("cause", cause, cause < 0.3).side == "below"
    assert split("idle", idle, cause > 0.7).score < 0.62


def test_the_claims_document_is_whole(tmp_path):
    result = claims(24, 0, QUIET)
    document = json.loads(write_result(result, tmp_path)[0].read_text(encoding="utf-8"))
    first = document["tables"][0]["rows"]
    assert [(row["claim"], row["P1"]) for row in first][:5] == [(c, "held") for c in "abcde"]
    shares = next(t for t in document["tables"] if t["title"].startswith("Share of"))["rows"]
    assert all(0 <= row["share"] <= 1 for row in shares)
    assert shares[-1]["share"] <= min(row["share"] for row in shares[:6])
    assert "surrogate" in (tmp_path / "claims.svg").read_text(encoding="utf-8")


def test_bad_counts_are_refused():
    with pytest.raises(InputError, match="sets: found -1"):
        claims(-1, 0, QUIET)
    with pytest.raises(InputError, match="loops: found 1"):
        fig3(bundled("yin2018"), 1, QUIET)


def test_the_page_is_what_its_table_says():
    study = json.loads(page.KEPT.read_text(encoding="utf-8"))
    assert page.PAGE.read_text(encoding="utf-8") == page.page(study)
    assert all((page.IMAGES / name).is_file() for name in page.PICTURES.values())


def test_the_kept_table_is_what_runs_now(through_fmu):
    """P1's corners of the kept Fig. 4, run again."""
    study = json.loads(page.KEPT.read_text(encoding="utf-8"))
    document = next(d for d in study["results"] if d["command"].endswith("fig4 --machine yin2018"))
    for row in document["tables"][0]["rows"]:
        error, _ = through_fmu.corner(row["turn"], row["speed [m/s]"], row["model"])
        assert 1e3 * error == pytest.approx(row["error [mm]"], abs=1e-4)
    assert "surrogate" in markdown(document)
