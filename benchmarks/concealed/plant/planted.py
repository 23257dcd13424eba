"""An effect as it is planted, and its nearest rivals in the catalogue."""

from dataclasses import dataclass, field, replace

import numpy as np

from .effects import Effect
from .evidence import cosine, gram, left_over

NEAREST = 3  # rivals that are fitted


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


def sized(effect, location, shapes, residual, columns):
    """A rival at the size, and of two quadratures at the phase, that its signatures (samples, 1 or
    2) give it; None where it has no such size, or nothing to show for it.
    """
    try:
        shares = np.linalg.solve(gram(columns, columns), gram(columns, residual[:, None]))[:, 0]
    except np.linalg.LinAlgError:
        return None
    share, shape = shares[0], dict(shapes[0])
    if len(shapes) == 2:
        turned = next(key for key in shape if shape[key] != shapes[1][key])
        share, shape[turned] = np.hypot(*shares), float(np.arctan2(shares[1], shares[0]))
    size = np.copysign(np.clip(abs(share) * effect.step, *effect.bounds), share)
    fits = share > 0.0 or effect.signed
    return Planted(effect, location, float(size), shape) if fits else None


@dataclass(frozen=True)
class Rival:
    """An effect near the planted one: the cosine between both, and itself as its signature is
    nearest, but where it is each recording's own.
    """

    name: str
    location: str
    cosine: float
    one: Planted | None

    def told(self):
        return {"name": self.name, "location": self.location, "cosine": self.cosine}


def nearest_rivals(catalogue, model, theta, jac, residual, planted):
    """The rivals whose retuned, linearised signatures are closest, nearest first."""
    here, found, known = model.output(theta), [], {}
    for effect, location in rivals(catalogue, model.experiment.drive, planted, model.beside):
        if effect.name == planted.effect.name and effect.tied:
            shared = {k: planted.shape[k] for k in effect.tied}
            effect = replace(effect, grid=tuple(one | shared for one in effect.grid))
        columns = signatures(model, theta, here, effect, location, known)
        found.append(nearest_shape(effect, location, left_over(jac, columns), residual))
    return sorted(found, key=lambda rival: -rival.cosine)[:NEAREST]


def nearest_shape(effect, location, seen, residual):
    """An effect in the shape of its grid whose signature (its columns of seen) is closest."""
    n = effect.group * seen.shape[1] // len(effect.grid)
    nears = [cosine(residual, seen[:, i : i + n]) for i in range(0, seen.shape[1], n)]
    k, near = int(np.argmax(nears)), max(nears)
    part = slice(n * k, n * (k + 1))
    shapes = effect.grid[part] if n == effect.group else ()
    one = sized(effect, location, shapes, residual, seen[:, part]) if shapes else None
    return Rival(effect.name, location, near, one)
