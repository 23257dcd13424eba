"""The bundled recordings of `corexy demo`: a concealed case, its twin and a null, from the plant.

`python -m benchmarks.concealed.examples` writes them to examples/ anew.  Those bundled are of the
plant of an earlier day, whose steps and machine files differed a little: docs/rivals.md stands on
them.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import plant

FOLDER = Path("examples")
SEED, NULL_SEED = 2018, 2019
CASE = {
    "kind": "effect",
    "effect": "backlash",
    "location": "motor1",
    "setting": "rectangles",
    "target_E": 5000.0,
    "machine": "yin2018",
    "noise": {"rho": 0.0, "sigma": 2e-5},
}
NULL = {
    "kind": "null",
    "setting": "rectangles",
    "machine": "yin2018",
    "noise": {"rho": 0.0, "sigma": 2e-5, "smooth_speed": 0.0},
}
NOTE = 'surrogate = "drawn around yin2018, a surrogate for the lost Table I of Yin et al. 2018"\n'


def _write(case: Any, folder: Path) -> None:
    plant.write(case, folder)
    toml = folder / "machine.toml"
    toml.write_text(toml.read_text().replace('name = "stage"\n', f'name = "{folder.name}"\n{NOTE}'))
    kept = {k: case.truth[k] for k in ("kind", "effects", "E", "E_sep", "setting", "noise")}
    (folder / "truth.json").write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n")


def main() -> None:
    """Write the three cases."""
    concealed = plant.draw(SEED, **CASE)
    _write(concealed, FOLDER / "1_concealed")
    _write(plant.twin(concealed), FOLDER / "2_twin")
    _write(plant.draw(NULL_SEED, **NULL), FOLDER / "3_null")


if __name__ == "__main__":
    main()
