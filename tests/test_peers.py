"""The peers run the case that they are said to run, and the page is what was measured."""

import json

import numpy as np
import pytest

from benchmarks import peers
from benchmarks.kernel_cost import operations
from benchmarks.outcome import RESULTS
from benchmarks.peer_case import Case
from benchmarks.peer_ours import lanes_run
from benchmarks.peer_scheme import arguments, loops_run, numba_run, numpy_run, plain
from benchmarks.peers_page import ALLOWED, PAGE, page, selected


@pytest.fixture(scope="module")
def case():
    """A part of the run, so that plain Python ends soon; the exact path is not needed."""
    whole = Case.named("yin2018")
    drive, rows = whole.drive, 160
    short = type(drive)(drive.time[:rows], drive.input1[:rows], drive.input2[:rows])
    whole.__dict__["drive"] = short
    return whole


@pytest.fixture(scope="module")
def path(case):
    """The kernel's."""
    return lanes_run(case, 1)()


def test_the_numpy_loop_is_the_kernels_scheme(case, path):
    assert numpy_run(case, case.count)() == pytest.approx(path, abs=1e-15)


def test_the_written_out_port_is_the_kernels_scheme(case, path):
    given = arguments(case, case.count)
    plain()(*given)
    assert given[-1] == pytest.approx(path, abs=1e-15)


def test_the_reference_is_no_copy_of_the_kernel():
    """Matrices of the case, from the topology's table, against Lagrange's, derived with SymPy."""
    from benchmarks.exact_stage import matrices

    case = Case.named("gt2_printer")
    arm = np.where(np.arange(12) < 2, 1.0, case.machine.parameters["pulley_radius"])
    _, k, _, _ = matrices(case.machine.parameters)
    mine = case.rows.T @ (case.stiffness[:, None] * case.rows)
    assert mine == pytest.approx(k / arm / arm[:, None], rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("make", [numba_run, loops_run])
def test_numbas_ports_are_the_kernels_scheme(case, path, make):
    pytest.importorskip("numba")
    assert make(case, case.count)() == pytest.approx(path, abs=1e-15)


def test_casadis_step_is_the_kernels_scheme(case, path):
    pytest.importorskip("casadi")
    from benchmarks.peer_casadi import casadi_run

    assert casadi_run(case, case.count)() == pytest.approx(path, abs=1e-15)


def test_mujocos_model_is_the_same_stage():
    pytest.importorskip("mujoco")
    from benchmarks.peer_mujoco import Setting, mujoco_run

    case = Case.named("gt2_printer")
    assert case.error(mujoco_run(case, Setting(10, "implicitfast", True))()) < ALLOWED


def test_absent_packages_are_told_and_left_out(case, monkeypatch):
    monkeypatch.setattr(peers.importlib.util, "find_spec", lambda name: None)
    assert peers.absent() == ["mujoco", "casadi", "numba"]
    names = {peer.name.split(",")[0] for peer in peers.peers(case, True)}
    assert names == {"this kernel", "NumPy loop", "SciPy LSODA", "SciPy Radau"}


def test_a_peer_is_shown_at_equal_accuracy():
    """The cheapest within what is allowed, else the most accurate; other steps of ours are not."""
    rows = [("a", 1.0, 9.0), ("a", 5.0, 1.9), ("a", 7.0, 0.1), ("b", 1.0, 8.0), ("b", 2.0, 3.0)]
    rows += [("this kernel, other steps", 0.1, 0.1), ("c", None, None)]
    points = [{"peer": p, "seconds": s, "error_um": e} for p, s, e in rows]
    chosen = [(r["peer"], r["seconds"]) for r in selected(points)]
    assert chosen == [("a", 5.0), ("b", 2.0)]


def test_operations_are_those_of_the_scheme():
    """By hand: 12 + 2 x 12 drifts, 10 travels, 12 tensions of 2 or 3 places, forces, kicks."""
    drifts, travels, commands = 2 * 2 * 12, 10, 4
    tensions = 12 + 4 * 1 + 4 * 1 + 4 * 2
    pulls = 2 * 3 + 10 * (1 + 1)
    kicks = 10 * 4
    assert operations()["sums_and_products"] == sum(
        (drifts, travels, commands, tensions, pulls, kicks)
    )
    assert operations()["least_size_sign"] == 10 * 3


def test_the_page_is_fresh():
    stored = json.loads((RESULTS / "peers.json").read_text(encoding="utf-8"))
    assert stored["command"] == "python -m benchmarks.peers"
    assert PAGE.read_text(encoding="utf-8") == page(stored)
