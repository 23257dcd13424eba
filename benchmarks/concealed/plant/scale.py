"""Scales planted effects to a wanted evidence, and measures it."""

from dataclasses import replace

import numpy as np

from .evidence import Model, fit, left_over, whitened
from .machines import pack
from .planted import merged, nearest_rival
from .recording import channels
from .world import experiment_of

CLOSE = 0.08  # log of E over its target that is good enough


def true_machine(world, planted):
    """Kernel array of the truth."""
    slots = merged(planted) | {"smooth_speed": world.noise["smooth_speed"]}
    return pack(world.values, world.drive, slots)


def clean(world, planted, train=True):
    """Noise-free channels of the training (or held-out) runs."""
    w = true_machine(world, planted)
    runs = world.runs[:2] if train else world.runs[2:]
    return [channels(w, run) for run in runs]


def resized(one, log_size):
    low, high = one.effect.bounds
    size = float(np.clip(np.exp(log_size), low, high))
    return replace(one, size=np.copysign(size, one.size).item())


def secant(measure, one, target, tries, widest):
    """The effect at the size whose measured E meets the target, as far as its bounds allow."""
    points, slope = [], 2.0
    for _ in range(tries):
        evidence = max(measure(one), 1e-9)
        points.append((np.log(abs(one.size)), np.log(evidence / target)))
        if len(points) > 1 and abs(points[-1][0] - points[-2][0]) > 1e-6:
            rise = (points[-1][1] - points[-2][1]) / (points[-1][0] - points[-2][0])
            slope = float(np.clip(rise, 0.7, 6.0))
        after = resized(one, points[-1][0] - np.clip(points[-1][1] / slope, -widest, widest))
        if abs(points[-1][1]) < CLOSE or after.size == one.size:
            break
        one = after
    return one


class Retuning:
    """Retuned fits of one model to growing or shrinking effects, each started from the last."""

    def __init__(self, world, beside=()):
        self.world, self.model = world, Model(experiment_of(world), beside)
        self.still = self.model.still()
        self.theta, self.jac, self.size = self.still, None, 1.0
        self.found = None

    def fit(self, planted, size=1.0, fresh=8):
        """E, from the best of the true parameters and the last fit, drawn to this size."""
        model, share = self.model, min(abs(size / self.size), 4.0)
        truth = whitened(model.experiment, clean(self.world, planted))
        drawn = np.clip(self.still + share * (self.theta - self.still), model.low, model.high)
        starts = [self.still, self.theta, drawn]
        costs = [model.cost(truth - model.output(theta), theta) for theta in starts]
        self.found = fit(model, truth, starts[int(np.argmin(costs))], self.jac, fresh)
        self.theta, self.jac, self.size = self.found.theta, self.found.jac, size
        return self.found.evidence


def to_target(world, one, target, thorough=True):
    """First on the linearised retuning, one simulation a try; then on the retuned fit itself."""
    retuning = Retuning(world)
    model, theta = retuning.model, retuning.still
    still = model.output(theta)
    retuning.jac = model.jacobian(theta, still)

    def linear(trial):
        away = whitened(model.experiment, clean(world, (trial,))) - still
        return float(np.sum(left_over(retuning.jac, away[:, None]) ** 2))

    one = secant(linear, one, target, 8, 1.5)
    for tries, fresh in ((4, 1), (3, 8)):
        one = secant(lambda t, f=fresh: retuning.fit((t,), t.size, f), one, target, tries, 1.5)
    if retuning.size != one.size:
        retuning.fit((one,), one.size)
    return one, retuning


def judge(world, planted, index, retuning=None):
    """E, E_sep and the nearest rival of one effect, with the others modelled beside it."""
    if retuning is None:
        retuning = Retuning(world, planted[:index] + planted[index + 1 :])
        retuning.fit(planted)
    model, found = retuning.model, retuning.found
    name, location, near = nearest_rival(
        model, found.theta, found.jac, found.residual, planted[index]
    )
    return {
        "E": found.evidence,
        "E_sep": found.evidence * (1.0 - near**2),
        "nearest_rival": {"name": name, "location": location, "cosine": near},
        "at_bound": model.at_bound(found.theta),
    }
