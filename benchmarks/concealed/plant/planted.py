"""An effect as it is planted, and its nearest rival in the catalogue."""

from dataclasses import dataclass, field, replace

import numpy as np

from .effects import Effect
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

    def at_bound(self):
        """Whether the size is as small or as large as it may be."""
        return any(abs(abs(self.size) / bound - 1.0) < 1e-6 for bound in self.effect.bounds)

    def scaled(self, factor):
        return replace(self, size=self.size * factor)


def merged(planted):
    """Kernel slots of several effects."""
    out = {}
    for one in planted:
        out |= one.slots()
    return out


def rivals(catalogue, drive, planted, beside):
    """Every other (effect, location) of the catalogue that the drive knows."""
    taken = {p.effect.name for p in beside} - {"pulley_eccentricity"}
    own = {(p.effect.name, p.location) for p in (planted, *beside)}
    for effect in catalogue:
        for location in effect.places(drive):
            if effect.name not in taken and (effect.name, location) not in own:
                yield effect, location


def signatures(model, theta, here, effect, location, known):
    """What small sizes of an effect, in each shape of its grid, add to the model's output."""
    parts = {"xy": ("x", "y"), "motors": ("motor1", "motor2")}.get(location, ())
    if parts and set(parts) <= set(effect.locations):
        return sum(signatures(model, theta, here, effect, part, known) for part in parts)
    if (effect.name, location) not in known:
        small = [Planted(effect, location, effect.step, shape).slots() for shape in effect.grid]
        columns = np.column_stack([model.output(theta, slots) - here for slots in small])
        known[effect.name, location] = split(model, columns) if effect.own else columns
    return known[effect.name, location]


def split(model, columns):
    """Each column as one for each recording: what is each recording's own scales there alone."""
    out, first = [], 0
    for length in model.lengths():
        part = np.zeros_like(columns)
        part[first : first + length] = columns[first : first + length]
        out, first = [*out, part], first + length
    return np.stack(out, axis=2).reshape(len(columns), -1)


def nearest_rival(catalogue, model, theta, jac, residual, planted):
    """The rival whose retuned, linearised signature is closest, and the cosine to it."""
    here, best, known = model.output(theta), ("none", "none", 0.0), {}
    for effect, location in rivals(catalogue, model.experiment.drive, planted, model.beside):
        if effect.name == planted.effect.name and effect.tied:
            shared = {k: planted.shape[k] for k in effect.tied}
            effect = replace(effect, grid=tuple(one | shared for one in effect.grid))
        found = signatures(model, theta, here, effect, location, known)
        seen, n = left_over(jac, found), effect.group * found.shape[1] // len(effect.grid)
        near = max(cosine(residual, seen[:, i : i + n]) for i in range(0, seen.shape[1], n))
        if near > best[2]:
            best = (effect.name, location, near)
    return best
