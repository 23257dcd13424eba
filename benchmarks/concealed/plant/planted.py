"""An effect as it is planted, and its nearest rival in the catalogue."""

from dataclasses import dataclass, field, replace

import numpy as np

from .effects import CATALOGUE, Effect
from .evidence import cosine, left_over


@dataclass(frozen=True)
class Planted:
    effect: Effect
    location: str
    size: float
    shape: dict = field(default_factory=dict)
    form: dict = field(default_factory=dict)

    def parameters(self):
        return self.effect.parameters(self.size, self.shape)

    def slots(self):
        return self.effect.slots(self.location, self.parameters(), self.form)

    def scaled(self, factor):
        return replace(self, size=self.size * factor)


def merged(planted):
    """Kernel slots of several effects."""
    out = {}
    for one in planted:
        out |= one.slots()
    return out


def rivals(drive, planted, beside):
    """Every other (effect, location) of the catalogue that the drive knows."""
    taken = {p.effect.name for p in beside} - {"pulley_eccentricity"}
    own = {(p.effect.name, p.location) for p in (planted, *beside)}
    for effect in CATALOGUE:
        for location in effect.locations:
            known = drive in effect.drives and effect.name not in taken
            if known and (effect.name, location) not in own:
                yield effect, location


def signatures(model, theta, here, effect, location, known):
    """What small sizes of an effect, in each shape of its grid, add to the model's output."""
    parts = {"xy": ("x", "y"), "motors": ("motor1", "motor2")}.get(location, ())
    if parts and set(parts) <= set(effect.locations):
        return sum(signatures(model, theta, here, effect, part, known) for part in parts)
    if (effect.name, location) not in known:
        small = [Planted(effect, location, effect.step, shape).slots() for shape in effect.grid]
        columns = [model.output(theta, slots) - here for slots in small]
        known[effect.name, location] = np.column_stack(columns)
    return known[effect.name, location]


def nearest_rival(model, theta, jac, residual, planted):
    """The rival whose retuned, linearised signature is closest, and the cosine to it."""
    here, best, known = model.output(theta), ("none", "none", 0.0), {}
    for effect, location in rivals(model.experiment.drive, planted, model.beside):
        seen = left_over(jac, signatures(model, theta, here, effect, location, known))
        spans = [seen] if effect.spans else [column[:, None] for column in seen.T]
        near = max(cosine(residual, span) for span in spans)
        if near > best[2]:
            best = (effect.name, location, near)
    return best
