"""A machine: its nominal parameters and priors, its controller and the effects that it has."""

from corexy_fmi.machine.file import (
    load_machine,
    machine_names,
    machine_path,
    machine_to_toml,
    models_folder,
    save_machine,
)
from corexy_fmi.machine.record import FREE_FORM, Controller, EffectUse, FreeForm, Machine

__all__ = [
    "FREE_FORM",
    "Controller",
    "EffectUse",
    "FreeForm",
    "Machine",
    "load_machine",
    "machine_names",
    "machine_path",
    "machine_to_toml",
    "models_folder",
    "save_machine",
]
