"""The figure of a rectangle run: whole files of every format, unknown endings refused."""

import numpy as np
import pytest

from corexy_fmi.corners import corner_table
from corexy_fmi.errors import InputError
from corexy_fmi.figure import draw_rectangle
from corexy_fmi.machine import load_machine
from corexy_fmi.motion import command
from corexy_fmi.recording import Recording
from corexy_fmi.rectangle import Rectangle

SHAPE = Rectangle(0.02, 0.015, 0.039)
START = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


def ideal_run(shift=0.0):
    order = command(SHAPE.motion, 1.0)
    x, y = (order["phi1"] + order["phi2"]) / 2, (order["phi1"] - order["phi2"]) / 2
    return Recording("run.csv", order.time, {"x": x + shift, "y": y})


@pytest.mark.parametrize("ending", START)
def test_every_format_is_whole(tmp_path, ending):
    run = ideal_run()
    path = tmp_path / f"run.{ending}"
    draw_rectangle(run, SHAPE, corner_table(run, SHAPE), load_machine("yin2018"), path)
    assert path.read_bytes().startswith(START[ending])
    assert list(tmp_path.iterdir()) == [path]


def test_a_run_that_never_crosses_is_drawn(tmp_path):
    run = ideal_run(shift=1.0)
    corners = corner_table(run, SHAPE)
    assert np.isnan(corners[0].contour_error)
    draw_rectangle(run, SHAPE, corners, load_machine("yin2018"), tmp_path / "run.png")
    assert (tmp_path / "run.png").is_file()


def test_an_unknown_ending_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"unknown ending '\.doc'"):
        draw_rectangle(ideal_run(), SHAPE, (), load_machine("yin2018"), tmp_path / "run.doc")
