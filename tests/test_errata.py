"""The paper's printed equations: the derivation, the package's table, and docs/errata.md."""

import numpy as np
import pytest
import sympy
from kernel_helpers import MACHINES, parameters

from benchmarks import errata, errata_runs
from benchmarks.errata_terms import (
    IDLERS,
    derived,
    growth,
    idlers_with_motor,
    printed_idler,
    printed_motor,
    reconstructions,
    rest_slope,
    symbols,
    with_rows,
    wrong_terms,
)
from corexy_fmi.topology import FULL


@pytest.fixture(scope="module")
def signs():
    found = reconstructions(parameters(), parameters("light_bench"))
    assert len(found) == 1
    return found[0]


@pytest.mark.parametrize("machine", MACHINES)
def test_the_derived_rows_are_the_packages_table(machine):
    """All 12 pulley columns of ten rows: derived symbolically, against the table of sections."""
    p = parameters(machine)
    rows = {i: derived(i) for i in range(1, 11)}
    found = with_rows(p, rows)
    assert found == pytest.approx(FULL.stiffness_matrix(p), rel=1e-12, abs=1e-12)
    printed = {**rows, 2: printed_motor(2)}
    assert np.abs(with_rows(p, printed) - FULL.stiffness_matrix(p)).max() > 1


def test_motor_2_alone_is_wrong_in_equation_10():
    assert wrong_terms(printed_motor(1), derived(1)) == []
    assert wrong_terms(printed_motor(2), derived(2)) == [("y", "k2*r", "-k2*r")]


def test_the_reconstruction_of_equation_8_shows_the_facts_that_are_known(signs):
    rows = errata_runs.printed_rows(signs)
    p, light = parameters(), parameters("light_bench")
    assert rest_slope(with_rows(p, rows), p["pulley_radius"]) == pytest.approx(0.21, abs=0.005)
    assert rest_slope(with_rows(p, {}), p["pulley_radius"]) == pytest.approx(0.5, rel=1e-12)
    assert growth(light, with_rows(light, rows)) > 0 > growth(light, with_rows(light, {}))
    wrong = {i for i in IDLERS if wrong_terms(printed_idler(i, signs), derived(i))}
    assert wrong == {3, 4, 5, 6, 7, 9, 10}


def test_derived_rows_pull_with_nothing_where_equation_1_holds(signs):
    q, r, _ = symbols()
    x, y = q[:2]
    turns = [x + y, x - y, -x, -x, x, x, x - y, x + y, x + y, x - y]
    placed = dict(zip(q[2:], [t / r for t in turns], strict=True))
    assert all(sympy.expand(derived(i).subs(placed)) == 0 for i in range(1, 11))
    left = {i for i in IDLERS if sympy.expand(printed_idler(i, signs).subs(placed)) != 0}
    assert left == {3, 4, 5, 6, 7, 9, 10}


def test_idlers_turn_with_the_motor_that_equation_12_denies():
    assert idlers_with_motor(1) == [8, 9]
    assert idlers_with_motor(2) == [7, 10]


def test_the_runs_agree_with_their_linear_limit(signs):
    """Rest by integration against rest by algebra, printed and derived."""
    p = parameters()
    for rows in (errata_runs.printed_rows(signs), {}):
        run = errata_runs.rest_after_two_radians(errata_runs.full_stage(p, rows, dry=False), p)
        assert run == pytest.approx(rest_slope(with_rows(p, rows), p["pulley_radius"]), rel=1e-6)


def test_the_runs_of_the_derived_equations_give_physics_5():
    p = parameters()
    errors = errata_runs.corner_errors(errata_runs.full_stage(p), p, 0.039)
    assert errors[0] == pytest.approx(0.572, rel=0.02)
    assert errors[1] == pytest.approx(0.2509, rel=0.04)  # friction is smooth here


def test_the_page_is_current():
    assert errata.PAGE.read_text(encoding="utf-8") == errata.page()
