"""An effect of one's own: a file beside the catalogue, and what of it is refused."""

from dataclasses import replace

import numpy as np
import pytest
from kernel_helpers import (
    STEP,
    assert_same,
    drive,
    excitation,
)
from own_effects import EVERY_PORT, LAG

from corexy_fmi.effects import catalogue, load_file
from corexy_fmi.effects.api import Law
from corexy_fmi.errors import InputError
from corexy_fmi.kernel.call import run_lanes
from corexy_fmi.kernel.generate import generated_header
from corexy_fmi.kernel.layout import (
    make_layout,
)
from corexy_fmi.simulate import neutral_vector


@pytest.mark.parametrize("text", [LAG, EVERY_PORT], ids=["lag", "every_port"])
def test_an_effect_of_ones_own_touches_no_other_file(tmp_path, text):
    file = tmp_path / "my_effect.py"
    file.write_text(text)
    effect = load_file(file)
    layout = make_layout({**catalogue(), effect.name: effect})
    bare = neutral_vector(layout)
    for location in effect.locations:
        values = bare.copy()
        values[layout.find(effect.name, location).parameter] = 0.01
        found = assert_same(layout, excitation(), values)
        reference = run_lanes(layout, excitation(), bare[None], limit=STEP)[0]
        assert np.abs(found[:2] - reference).max() > 1e-6


def test_own_lag_obeys_its_equation(tmp_path):
    """x_m = x - T v behind a ramp, once the start has faded."""
    (tmp_path / "lag.py").write_text(LAG)
    effect = load_file(tmp_path / "lag.py")
    layout = make_layout({effect.name: effect})
    values = neutral_vector(layout)
    values[layout.find("my_lag", "sensor").parameter] = 0.01
    time = np.arange(500) * 1e-3
    given = drive(time, np.column_stack([0.05 * time, 0 * time]))
    x, true = run_lanes(layout, given, values[None], channels=("x", "x_true"))[0]
    assert x[-1] == pytest.approx(true[-1] - 0.01 * 0.05, abs=0.05 * 2e-4)


BROKEN = {
    "reads nothing known": ("guide", lambda nonsense: {"bound": nonsense}, "reads nonsense"),
    "may not write": ("guide", lambda velocity: {"velocity": velocity}, "may not write velocity"),
    "may not remember": ("sensor", lambda x: {"seat": x}, "may not remember seat"),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_a_wrong_law_is_refused(kind):
    port, function, words = BROKEN[kind]
    function.__name__ = "broken"
    effect = replace(catalogue()["backlash"], laws=(Law(port, function),))
    with pytest.raises(ValueError, match=words):
        generated_header(make_layout({"backlash": effect}))


@pytest.mark.parametrize("name", ["step", "double", "pull", "two words", "t_1"])
def test_a_taken_name_is_refused(name):
    """A memory called like a variable of the port would silently read the wrong one."""
    effect = replace(catalogue()["backlash"], memory=(name,))
    with pytest.raises(ValueError, match=f"'{name}' is taken"):
        generated_header(make_layout({"backlash": effect}))


@pytest.mark.parametrize("text", ["EFFECT = 3", "import nonsense_that_is_not_there", "def ("])
def test_a_file_that_is_no_effect(tmp_path, text):
    (tmp_path / "no.py").write_text(text)
    with pytest.raises(InputError, match=r"no\.py"):
        load_file(tmp_path / "no.py")
