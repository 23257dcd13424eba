"""Scales planted effects to a wanted evidence, and measures it."""

from dataclasses import replace

import numpy as np

from .evidence import REACHES, Model, fit, left_over, whitened
from .machines import pack, steps_per_ms
from .planted import merged, nearest_rivals
from .recording import channels
from .world import experiment_of

CLOSE = 0.12  # log of E over its target that is good enough
TAKES = 0.5  # share of E that a rival leaves, below which it may have shown a better retuning
LINEAR = 0.1  # log of linearised over real E, below which there is one minimum only
DEAREST = 100  # steps in a ms: a rival that wants more is known by its angle alone
LOST = 1e7  # E over its target from which the stage goes its own way, and no retuning leads back


def true_machine(world, planted):
    """Kernel array of the truth."""
    slots = merged(planted) | {"smooth_speed": world.noise["smooth_speed"]}
    return pack(world.values, world.drive, slots)


def clean(world, planted, train=True):
    """Noise-free channels of the training (or held-out) runs."""
    w = true_machine(world, planted)
    runs = world.runs[:2] if train else world.runs[2:]
    return [channels(w, run) for run in runs]


def slips(world, planted):
    """Whether a rotor on its magnetic spring falls into another pole in any run: what follows is
    missed steps, another effect."""
    if not any(one.effect.name == "stepper_compliance" for one in planted):
        return False
    pole = world.values["pulley_radius"] * 2.0 * np.pi / 50.0
    pairs = [
        (left[n], right[n])
        for train in (True, False)
        for left, right in zip(clean(world, planted, train), clean(world, (), train), strict=True)
        for n in "xy"
    ]
    return not all(np.abs(a - b).max() < pole / 2.0 for a, b in pairs)


def next_size(one, points):
    """A better size, from points (log size, log of E over its target); kept between the
    sizes known to be too small and too large, and within its bounds."""
    (here, off), slope = points[-1], 2.0
    if len(points) > 1 and abs(here - points[-2][0]) > 1e-6:
        slope = np.clip((off - points[-2][1]) / (here - points[-2][0]), 0.7, 6.0)
    low, high = np.log(one.effect.bounds)
    small = max((size for size, o in points if o < 0.0), default=low)
    large = min((size for size, o in points if o > 0.0), default=high)
    wanted = here - np.clip(off / slope, -1.5, 1.5)
    if small < large and not small < wanted < large:
        wanted = 0.5 * (small + large) if low < small and large < high else wanted
    size = float(np.exp(np.clip(wanted, low, high)))
    return replace(one, size=np.copysign(size, one.size).item())


def search(measure, one, target, tries):
    """The effect at the size whose measured E comes closest to the target, and its measure."""
    points, best = [], None
    for _ in range(tries):
        found = measure(one)
        off = float(np.log(np.clip(np.nan_to_num(found[0], nan=1e30), 1e-9, 1e30) / target))
        points.append((float(np.log(abs(one.size))), off))
        if best is None or abs(off) < best[0]:
            best = (abs(off), one, found)
        after = next_size(one, points)
        if abs(off) < CLOSE or after.size == one.size:
            break
        one = after
    return best[1:]


class Retuning:
    """Retuned fits of one model to growing or shrinking effects, each started from the last."""

    def __init__(self, world, beside=()):
        self.world, self.model = world, Model(experiment_of(world), beside)
        self.still = self.model.still()
        self.plain = self.model.output(self.still)
        self.slopes = self.model.jacobian(self.still, self.plain)
        self.last, self.size = None, 1.0

    def linear(self, planted):
        """E where the retuned model is linear in its parameters."""
        away = whitened(self.model.experiment, clean(self.world, planted)) - self.plain
        return float(np.sum(left_over(self.slopes, away[:, None]) ** 2))

    def fit(self, planted, size=1.0, thorough=True):
        """From the best of the true parameters and the last fit, also drawn to this size.

        Thorough, and where the linearised retuning misses E: from the true parameters too, in
        longer steps, and then on from the better end.
        """
        model = self.model
        truth = whitened(model.experiment, clean(self.world, planted))
        starts = [(self.still, self.slopes)]
        if self.last is not None:
            theta, share = self.last.theta, min(abs(size / self.size), 4.0)
            drawn = np.clip(self.still + share * (theta - self.still), model.low, model.high)
            starts += [(theta, self.last.jac), (drawn, self.last.jac)]
        costs = [model.cost(truth - model.output(theta), theta) for theta, _ in starts]
        first = starts[int(np.argmin(costs))]
        found = fit(model, truth, *first, 5 if thorough else 1)
        away = left_over(self.slopes, (truth - self.plain)[:, None])
        bent = abs(np.log(np.sum(away**2) / found.evidence)) > LINEAR
        if thorough and bent:
            other = fit(model, truth, self.still, self.slopes, 4, reach=REACHES[1])
            found = min(found, other, key=lambda one: one.evidence)
            found = fit(model, truth, found.theta, found.jac, 4)
        self.last, self.size = found, size
        return found


def to_target(world, one, target):
    """First on the linearised retuning, one simulation a try; then on the retuned fit itself."""
    retuning = Retuning(world)

    def linear(trial):
        return (np.inf if slips(world, (trial,)) else retuning.linear((trial,))), None

    lost = {}  # first fits at sizes that are far beyond, which fits from their ends need not follow

    def retuned(trial, thorough):
        if thorough and trial.size in lost:
            return np.inf, lost[trial.size]
        before = retuning.last, retuning.size
        found = retuning.fit((trial,), trial.size, thorough)
        if found.evidence > LOST * target:
            lost[trial.size], (retuning.last, retuning.size) = found, before
        return (np.inf if slips(world, (trial,)) else found.evidence), found

    one, _ = search(linear, one, target, 8)
    one, _ = search(lambda trial: retuned(trial, False), one, target, 5)
    one, (_, found) = search(lambda trial: retuned(trial, True), one, target, 3)
    retuning.last, retuning.size = found, one.size
    return one, retuning


def with_rival(model, found, rival):
    """The fit where a rival's size is free, too: signatures bend, and their angle may tell twins
    apart that are none.
    """
    both = Model(model.experiment, (*model.beside, rival))
    known = dict(zip(model.groups, found.theta, strict=False))
    sizes, bends = np.split(found.theta[model.n_nominal :], [len(model.beside)])
    theta = np.concatenate([[known.get(g, 0.0) for g in both.groups], sizes, [0.0], bends])
    truth = found.residual + model.output(found.theta)
    return both, fit(both, truth, theta)


def without_rival(model, found, both, end):
    """The retuned fit once more from where one with a rival ended; the better of both."""
    n = both.n_machine
    known = dict(zip(both.groups, end.theta, strict=False))
    machine = [*(known.get(g, 0.0) for g in model.groups), *end.theta[both.n_nominal : n - 1]]
    theta = np.clip(np.concatenate([machine, end.theta[n:]]), model.low, model.high)
    truth = found.residual + model.output(found.theta)
    return min(found, fit(model, truth, theta), key=lambda one: one.evidence)


def dear(model, theta, rival):
    """Whether a model with this rival beside it is too dear to fit."""
    return steps_per_ms(model.machine(theta, rival.slots())) > DEAREST


def judge(retuning, planted):
    """E, E_sep and the nearest rival of one effect, from the retuned fit without it.

    E_sep is what is left by the angle to a rival or, if that is less, where it is fitted (unless
    its runs are too dear: a winding of 20 us wants 182 steps in a ms).
    """
    model, found, last = retuning.model, retuning.last, retuning.last
    catalogue = retuning.world.catalogue
    ranked = nearest_rivals(catalogue, model, last.theta, last.jac, last.residual, planted)
    apart = [last.evidence * (1.0 - rival.cosine**2) for rival in ranked]
    for n, rival in enumerate(ranked):
        if rival.one is not None and not dear(model, last.theta, rival.one):
            both, end = with_rival(model, last, rival.one)
            apart[n] = min(apart[n], end.evidence)
            if end.evidence < TAKES * last.evidence:
                found = without_rival(model, found, both, end)
    retuning.last, least = found, int(np.argmin(apart))
    return {
        "E": found.evidence,
        "E_sep": min(apart[least], found.evidence),
        "nearest_rival": ranked[least].told(),
        "at_bound": model.at_bound(found.theta),
    }
