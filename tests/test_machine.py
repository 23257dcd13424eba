"""Machine files: read, written back the same, and refused with one line where they are wrong."""

import pickle
from dataclasses import replace

import pytest

from corexy_fmi.errors import InputError
from corexy_fmi.machine import (
    Controller,
    EffectUse,
    FreeForm,
    load_machine,
    machine_names,
    machine_to_toml,
    save_machine,
)
from corexy_fmi.parameters import defaults

FULL = """
[machine]
name = "stage \\"7\\""
drive = "dc"
[controller]
kp = 12.5
kd = 0
[parameters]
carriage_mass = {value = 0.1000000000000000055, rel_std = 0.1}
bridge_mass = 1
[[effects]]
name = "backlash"
location = "motor1"
parameters = {gap = 0.0212345678901234567}
[[effects]]
name = "free_form"
location = "motor2"
argument = "phi2"
knots = [-1.0, 0.1, 2.0]
values = [0.0, 1e-3, 0.30000000000000004]
"""


@pytest.fixture
def machine_file(tmp_path):
    """Writes a machine file and gives its path."""

    def write(text):
        path = tmp_path / "stage.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_every_key_is_read(machine_file):
    machine = load_machine(machine_file(FULL))
    assert machine.name == 'stage "7"'
    assert machine.controller == Controller(12.5, 0.0)
    assert machine.parameters["bridge_mass"] == 1.0
    assert machine.rel_std["carriage_mass"] == 0.1
    assert machine.rel_std["bridge_mass"] == 0.2
    assert machine.effects[0].location == "motor1"
    assert machine.free_forms == (
        FreeForm("motor2", "phi2", (-1.0, 0.1, 2.0), (0.0, 1e-3, 0.1 + 0.2)),
    )


def test_parameters_left_out_are_yin2018_and_said_to_be(machine_file):
    machine = load_machine(machine_file(FULL))
    assert machine.parameters["motor_inertia"] == defaults("dc")["motor_inertia"]
    assert "pulley_radius" in machine.surrogate
    assert "surrogate" in machine.surrogate
    assert "carriage_mass" not in machine.surrogate


@pytest.mark.parametrize("source", [FULL, "", "[machine]\nfidelity = 'kinematic'"])
def test_round_trip_is_exact(machine_file, tmp_path, source):
    machine = load_machine(machine_file(source))
    save_machine(machine, tmp_path / "again.toml")
    assert load_machine(tmp_path / "again.toml") == machine
    assert machine_to_toml(load_machine(tmp_path / "again.toml")) == machine_to_toml(machine)


def test_a_machine_travels_between_processes():
    machine = load_machine("yin2018")
    assert pickle.loads(pickle.dumps(machine)) == machine


def test_bundled_machines_load_by_name_folder_and_file(tmp_path):
    assert {"yin2018", "yin2018_dc", "light_bench", "gt2_printer"} <= set(machine_names())
    for name in machine_names():
        machine = load_machine(name)
        assert machine.name == name
        assert list(machine.parameters) == [p.name for p in machine.kind.parameters]
    save_machine(load_machine("gt2_printer"), tmp_path / "machine.toml")
    assert load_machine(tmp_path) == load_machine("gt2_printer")


def test_a_bundled_name_means_the_bundled_machine_wherever_it_stands(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    own = replace(load_machine("light_bench"), name="own")
    (tmp_path / "yin2018").mkdir()
    save_machine(own, tmp_path / "yin2018" / "machine.toml")
    assert load_machine("yin2018").name == "yin2018"
    assert load_machine("./yin2018").name == "own"
    assert load_machine(tmp_path / "yin2018").name == "own"


@pytest.mark.parametrize("name", ["yin2018", "yin2018_dc", "light_bench"])
def test_numbers_of_the_lost_table_are_labelled(name):
    assert "surrogate" in load_machine(name).surrogate


def test_all_parameters_of_an_effect_are_filled(machine_file):
    rest = {"grip": 1.0, "hold": 0.0, "seat1": 0.0, "seat2": 0.0}
    text = "[[effects]]\nname = 'backlash'\nlocation = 'motors'\nparameters = {gap = 0.01}"
    (use,) = load_machine(machine_file(text)).effects
    assert use == EffectUse("backlash", "motors", {"gap": 0.01, **rest})


def effect(name, location="x", more="parameters = {}"):
    return f"[[effects]]\nname = '{name}'\nlocation = '{location}'\n{more}"


def free_form(knots, values, location="x", argument="vx", acts="force", more=""):
    told = f"argument = '{argument}'\nacts = '{acts}'\nknots = {knots}\nvalues = {values}"
    return effect("free_form", location, f"{told}\n{more}")


def test_a_loop_beside_a_stepper_stands_idle(machine_file):
    assert load_machine(machine_file("[controller]\nkp = 20.0\nkd = 0.1\n")).controller is None


def test_a_friction_over_time_has_an_onset_and_a_viscous_share(machine_file):
    more = "viscous = 12.5\nonset = -0.25\n"
    machine = load_machine(machine_file(free_form([0, 1], [0, 2], "y", "t", "friction", more)))
    (law,) = machine.free_forms
    assert (law.viscous, law.onset) == (12.5, -0.25)
    assert load_machine(machine_file(machine_to_toml(machine))).free_forms == (law,)


def test_a_free_form_is_a_force_or_a_friction_and_written_back(machine_file):
    found = {}
    for acts in ("force", "friction"):
        machine = load_machine(machine_file(free_form([0, 1], [0.0, 2.0], "y", "y", acts)))
        found[acts] = machine_to_toml(machine)
        assert machine.free_forms == (FreeForm("y", "y", (0.0, 1.0), (0.0, 2.0), acts),)
        assert load_machine(machine_file(found[acts])) == machine
    assert "acts" not in found["force"]


STRIBECK = "parameters = {static_ratio = 2.0, speed = 0.01}"
BAD = {
    "not TOML": ("[machine", "not TOML"),
    "unknown table": ("[machines]", "'machines', expected one of machine,"),
    "unknown head key": ("[machine]\nfidelty = 'full'", "nearest known: fidelity"),
    "machine is no table": ("machine = 3", "machine: found 3, expected a table"),
    "name of two lines": ("[machine]\nname = 'a\\nb'\nx = 1", "unknown key 'x'"),
    "name no text": ("[machine]\nname = 3", "machine.name: found 3"),
    "topology": ("[machine]\ntopology = 'delta'", "machine.topology: found 'delta'"),
    "drive": ("[machine]\ndrive = 'step'", "nearest known: stepper"),
    "fidelity": ("[machine]\nfidelity = 'ful'", "nearest known: full"),
    "condensed dc": ("[machine]\ndrive='dc'\nfidelity='condensed'", "knows no dc drive"),
    "kinematic dc": ("[machine]\ndrive='dc'\nfidelity='kinematic'", "knows no dc drive"),
    "controller of a stepper": ("[controller]\nkp = -1\nkd = 0", "controller.kp: found -1"),
    "controller key": ("[machine]\ndrive='dc'\n[controller]\nki = 1", "unknown key 'ki'"),
    "controller gain missing": ("[machine]\ndrive='dc'\n[controller]\nkp = 1", "controller.kd"),
    "unknown parameter": ("[parameters]\ncarriage_mas = 1", "nearest known: carriage_mass"),
    "true is no number": ("[parameters]\ncarriage_mass = true", "found true, expected a number"),
    "text is no number": ("[parameters]\ncarriage_mass = '1'", "found '1', expected a number"),
    "nan": ("[parameters]\ncarriage_mass = nan", "found nan, expected a number"),
    "out of bounds": (
        "[parameters]\ncarriage_mass = -1",
        "expected a value from 0.001 to 100 [kg]",
    ),
    "parameter without value": ("[parameters]\nbridge_mass = {rel_std = 1}", "no key 'value'"),
    "parameter's unknown key": ("[parameters]\nbridge_mass = {val = 1}", "nearest known: value"),
    "prior out of bounds": (
        "[parameters]\nbridge_mass = {value = 1, rel_std = -1}",
        "bridge_mass.rel_std: found -1",
    ),
    "clip wider than bridge": (
        "[parameters]\nclip_spacing = 0.24",
        "less than bridge_pulley_spacing",
    ),
    "effects one table": ("[effects]\nname = 'backlash'", "[[effects]] in double brackets"),
    "effect without name": ("[[effects]]\nlocation = 'x'", "no key 'name'"),
    "unknown effect": (effect("stribeck"), "nearest known: stribeck_friction"),
    "effect's unknown key": (effect("backlash", "motor1", "gap = 1"), "unknown key 'gap'"),
    "unknown location": (effect("backlash", "belts"), "found 'belts'"),
    "missing parameter": (
        effect("backlash", "motor1"),
        "backlash.parameters.gap: missing, expected a number [rad]",
    ),
    "missing torque": (
        effect("periodic_disturbance", "motor1"),
        "amplitude: missing, expected a number [N m]",
    ),
    "unknown effect parameter": (
        effect("backlash", "motor1", "parameters = {gab = 1}"),
        "nearest known: gap",
    ),
    "effect out of bounds": (
        effect("backlash", "motor1", "parameters = {gap = 9}"),
        "expected a value from 0 to 0.5 [rad]",
    ),
    "effect unknown to fidelity": (
        "[machine]\nfidelity = 'kinematic'\n" + effect("stribeck_friction", "x", STRIBECK),
        "unknown to fidelity 'kinematic'",
    ),
    "idler unknown to reduced": (
        "[machine]\nfidelity = 'reduced'\n" + effect("pulley_eccentricity", "pulley3"),
        "found 'pulley3'",
    ),
    "effect unknown to drive": (
        "[machine]\ndrive = 'dc'\n" + effect("stepper_compliance", "motors"),
        "unknown to drive 'dc'",
    ),
    "effect twice": (
        "\n".join([effect("stribeck_friction", "x", STRIBECK)] * 2),
        "stribeck_friction at x twice",
    ),
    "free form off the coordinates": (free_form([0, 1], [0, 1], "belts"), "found 'belts'"),
    "free form of a stepper's motor": (free_form([0, 1], [0, 1], "motor1"), "found 'motor1'"),
    "free form's argument": (free_form([0, 1], [0, 1], argument="v"), "nearest known: v"),
    "friction over a speed": (free_form([0, 1], [0, 1], acts="friction"), "found 'vx'"),
    "friction of a motor": (
        "[machine]\ndrive = 'dc'\n" + free_form([0, 1], [0, 1], "motor1", "x", "friction"),
        "found 'motor1'",
    ),
    "free form's kind": (free_form([0, 1], [0, 1], acts="fraction"), "nearest known: friction"),
    "free form's lengths": (free_form([0, 1], [0, 1, 2]), "expected 2 as knots"),
    "free form's order": (free_form([0, 0], [0, 1]), "strictly increasing"),
    "free form's numbers": (free_form([0, "true"], [0, 1]).replace("'", ""), "not TOML"),
    "viscous force": (free_form([0, 1], [0, 1], more="viscous = 1"), "only where a law acts as"),
    "onset of a place": (free_form([0, 1], [0, 1], more="onset = 1"), "only with argument 't'"),
    "onset no number": (free_form([0, 1], [0, 1], "x", "t", more="onset = 'late'"), "onset"),
    "free form too short": (
        free_form([0], [1]),
        "found a list of 1, expected a list of 2 to 24 numbers",
    ),
    "kinematic free form": (
        "[machine]\nfidelity = 'kinematic'\n" + free_form([0, 1], [0, 1]),
        "unknown to fidelity 'kinematic'",
    ),
}


@pytest.mark.parametrize(("text", "said"), BAD.values(), ids=BAD)
def test_mistakes_are_refused_in_one_line(machine_file, text, said):
    path = machine_file(text)
    with pytest.raises(InputError) as caught:
        load_machine(path)
    line = str(caught.value)
    assert said in line
    assert line.startswith(str(path))
    assert "\n" not in line


@pytest.mark.parametrize("letter", ["0000", "0001", "0009", "000D", "0085", "2028", "FFFE"])
@pytest.mark.parametrize("key", ["name", "surrogate"])
def test_letters_that_do_not_print_are_refused(machine_file, letter, key):
    test_mistakes_are_refused_in_one_line(
        machine_file, f'[machine]\n{key} = "a\\u{letter}b"', f"machine.{key}: found 'a\\"
    )


def test_letters_of_any_script_are_a_name(machine_file):
    assert (
        load_machine(machine_file("[machine]\nname = 'größe 大 \U0001f600 <&>'")).name[-3:] == "<&>"
    )


def test_unknown_machine_names_the_nearest():
    with pytest.raises(InputError, match="nearest known: yin2018"):
        load_machine("yin218")


def test_absent_and_binary_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        load_machine(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        load_machine(tmp_path / "binary.toml")
    with pytest.raises(InputError, match="expected a machine file"):
        load_machine(tmp_path)
