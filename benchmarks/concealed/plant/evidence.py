"""E and E_sep: what the retuned nominal model cannot explain, in the plant's own code.

E = min over nominal parameters and nuisances of (s - m)' S^-1 (s - m), with s the noise-free
truth, m the nominal model, S the noise covariance. A constant offset of each measured channel
is projected out unless it has the inputs' zero; nominal parameters and initial belt deflections
are fitted.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numba import njit

from .machines import pack
from .recording import channels, measured

HELD = "belt_axial_stiffness"
REACHES = (0.8, 2.0)  # log of the factor by which one step may change a parameter
BOX = 100.0  # a nominal parameter stays within a factor of 200 of its true value
WEAK, WEAK_DEFLECTION = 0.03, 1e-5
DEFLECTION, DIFFERENCE = 1e-5, 4e-3
ABREAST = ThreadPoolExecutor(os.cpu_count())  # the solver holds no lock of the interpreter


@dataclass(frozen=True)
class Experiment:
    """Recordings, their noise, and the true machine, where the search for nominal ones starts."""

    drive: str
    values: dict
    free: tuple  # groups of nominal parameters that are retuned together
    runs: tuple
    noise: tuple  # per run: channel -> (sigma, rho, taken mask, whether it has the inputs' zero)


@njit(cache=True, nogil=True)
def whiten(values, sigma, rho, taken, zeroed=False):
    """Exact whitening of AR(1) noise with blanks, a constant offset projected out unless zeroed.

    rho belongs to one sampling interval, which is the smallest distance of two samples.
    """
    rows = np.flatnonzero(taken)
    every = np.diff(rows).min()
    out, one = np.empty(len(rows)), np.empty(len(rows))
    out[0], one[0] = values[rows[0]] / sigma, 1.0 / sigma
    onto, norm = out[0] * one[0], one[0] * one[0]
    for k in range(1, len(rows)):
        fade = rho ** ((rows[k] - rows[k - 1]) // every) if rho > 0.0 else 0.0
        gain = 1.0 / (sigma * np.sqrt(1.0 - fade * fade))
        out[k] = gain * (values[rows[k]] - fade * values[rows[k - 1]])
        one[k] = gain * (1.0 - fade)
        onto += out[k] * one[k]
        norm += one[k] * one[k]
    for k in range(0 if zeroed else len(rows)):
        out[k] -= one[k] * onto / norm
    return out


def whitened_run(shown, noise):
    return np.concatenate([whiten(shown[name], *noise[name]) for name in measured(shown)])


def whitened(experiment, shown):
    """All measured samples of all runs as one vector of unit variance."""
    pairs = zip(shown, experiment.noise, strict=True)
    return np.concatenate([whitened_run(one, noise) for one, noise in pairs])


class Model:
    """The nominal model, with effects beside it whose sizes are free too.

    theta: one number u for each free group of parameters, which stands for the factor
    u + sqrt(u^2 + 1) on its true value (linear far up, positive far down); the same for the
    sizes of the effects beside; then the initial deflections in units of 10 um. Zero is the
    true machine. Where nothing stands beside, the belt's stiffness is held: all masses,
    stiffnesses and frictions together leave the motion as it is.
    """

    def __init__(self, experiment, beside=()):
        self.experiment, self.beside = experiment, tuple(beside)
        held = () if beside else (HELD,)
        self.groups = [g for g in experiment.free if g[0] not in held]
        self.n_nominal = len(self.groups)
        self.n_machine = self.n_nominal + len(self.beside)
        self.size = self.n_machine + 2 * len(experiment.runs)
        self.low, self.high = np.full(self.size, -300.0), np.full(self.size, 300.0)
        self.low[: self.n_machine], self.high[: self.n_machine] = -BOX, BOX
        # idlers lighter than half move the same, but in ever smaller steps
        self.low[self.groups.index(("pulley_inertia",))] = np.sinh(np.log(0.5))

    def still(self):
        """theta of the true machine."""
        bends = np.concatenate([r.deflection for r in self.experiment.runs]) / DEFLECTION
        return np.concatenate([np.zeros(self.n_machine), bends])

    def values(self, theta):
        out = dict(self.experiment.values)
        for group, u in zip(self.groups, theta, strict=False):
            for name in group:
                out[name] *= float(np.exp(np.arcsinh(u)))
        return out

    def around(self, theta, reach):
        """The box that one step may reach."""
        low, high, n = self.low.copy(), self.high.copy(), self.n_machine
        here = np.arcsinh(theta[:n])
        low[:n] = np.maximum(low[:n], np.sinh(here - reach))
        high[:n] = np.minimum(high[:n], np.sinh(here + reach))
        return low, high

    def at_bound(self, theta):
        """Names of the nominal parameters that the box holds back."""
        touched = (theta < 1e-6 - BOX) | (theta > BOX - 1e-6)
        pairs = zip(self.groups, touched, strict=False)
        return [group[0] for group, touched in pairs if touched]

    def machine(self, theta, more=None):
        """Kernel array at theta; `more`: slots of one more effect."""
        slots = dict(more or {})
        sizes = np.exp(np.arcsinh(theta[self.n_nominal : self.n_machine]))
        for planted, factor in zip(self.beside, sizes, strict=True):
            slots |= planted.scaled(factor).slots()
        return pack(self.values(theta), self.experiment.drive, slots)

    def output_run(self, theta, k, more=None):
        """Whitened channels of run k."""
        bend = theta[self.n_machine + 2 * k : self.n_machine + 2 * k + 2] * DEFLECTION
        with np.errstate(over="ignore", invalid="ignore"):  # a trial may be unstable
            shown = channels(self.machine(theta, more), self.experiment.runs[k], bend)
        return whitened_run(shown, self.experiment.noise[k])

    def lengths(self):
        """Number of whitened samples of each run."""
        return [sum(int(np.sum(n[2])) for n in one.values()) for one in self.experiment.noise]

    def abreast(self, asked):
        """Whitened channels of every (theta, run, more), in order; how many run at once changes
        no bit.
        """
        return list(ABREAST.map(lambda one: self.output_run(*one), asked))

    def output(self, theta, more=None):
        runs = range(len(self.experiment.runs))
        return np.concatenate(self.abreast([(theta, k, more) for k in runs]))

    def jacobian(self, theta, here):
        """Finite differences; a deflection moves its own recording only."""
        out, runs = np.zeros((len(here), self.size)), range(len(self.experiment.runs))
        ends = np.concatenate([[0], np.cumsum(self.lengths())])
        steps, n = np.full(self.size, 0.1), self.n_machine
        steps[:n] = DIFFERENCE * np.sqrt(1.0 + theta[:n] ** 2)
        steps *= np.where(theta + steps > self.high, -1.0, 1.0)
        asked = [(i, k) for i in range(self.size) for k in runs if i < n or k == (i - n) // 2]
        moved = theta + np.diag(steps)
        shown = self.abreast([(moved[i], k) for i, k in asked])
        for (i, k), there in zip(asked, shown, strict=True):
            own = slice(ends[k], ends[k + 1])
            out[own, i] = (there - here[own]) / steps[i]
        return out

    def ridge(self, theta):
        """A very weak pull towards the true machine, and its slope: for what no data decide."""
        out, slope = np.sqrt(WEAK_DEFLECTION) * theta, np.full(self.size, np.sqrt(WEAK_DEFLECTION))
        machine = theta[: self.n_machine]
        out[: self.n_machine] = np.sqrt(WEAK) * np.arcsinh(machine)
        slope[: self.n_machine] = np.sqrt(WEAK / (1.0 + machine**2))
        return out, slope

    def cost(self, residual, theta):
        cost = float(np.sum(residual**2) + np.sum(self.ridge(theta)[0] ** 2))
        return cost if np.isfinite(cost) else np.inf


def damped_step(model, jac, residual, theta, damping, reach):
    """Levenberg-Marquardt step within the box and a smaller one around theta."""
    pull, slope = model.ridge(theta)
    normal = gram(jac, jac) + np.diag(slope**2)
    right = gram(jac, residual[:, None])[:, 0] - slope * pull
    normal += np.diag(damping * np.diag(normal))
    scale = 1.0 / np.sqrt(np.diag(normal))
    normal, right = normal * scale[:, None] * scale, right * scale
    low, high = model.around(theta, reach)
    low, high, out = (low - theta) / scale, (high - theta) / scale, np.zeros(model.size)
    free = np.ones(model.size, bool)
    for _ in range(model.size):
        rest = right[free] - normal[np.ix_(free, ~free)] @ out[~free]
        out[free] = np.linalg.solve(normal[np.ix_(free, free)], rest)
        beyond = free & ((out < low) | (out > high))
        out = np.clip(out, low, high)
        if not beyond.any():
            break
        free &= ~beyond
    return np.clip(theta + scale * out, model.low, model.high)


@dataclass
class Fit:
    """A retuned fit: where it ended, what is left over, and its last Jacobian."""

    theta: np.ndarray
    residual: np.ndarray
    jac: np.ndarray

    @property
    def evidence(self):
        return float(np.sum(self.residual**2))


def fit(model, truth, theta, jac=None, fresh=4, enough=0.01, reach=REACHES[0]):
    """Levenberg-Marquardt from theta; Broyden's update keeps a Jacobian usable.

    It ends where a step on a fresh Jacobian gains less than the share `enough`, or where
    `fresh` Jacobians are used up; at once where the model breaks down at theta, with an evidence
    that is no number, and less than none.
    """
    here, exact, damping, refused = model.output(theta), False, 1e-4, 0
    cost = model.cost(truth - here, theta)
    if not np.isfinite(cost):
        return Fit(theta, truth - here, np.zeros((len(here), model.size)))
    while True:
        if jac is None:
            jac, exact, fresh, refused = model.jacobian(theta, here), True, fresh - 1, 0
        trial = damped_step(model, jac, truth - here, theta, damping, reach)
        there = model.output(trial)
        gain = cost - model.cost(truth - there, trial)
        if gain > 0.0:
            moved, weight = trial - theta, np.sum(jac**2, axis=0)
            missed = there - here - jac @ moved
            jac = jac + np.outer(missed, weight * moved / np.sum(weight * moved**2))
            theta, here, cost, damping = trial, there, cost - gain, max(0.1 * damping, 1e-8)
        else:
            refused, damping = refused + 1, 30.0 * max(damping, 1e-4)
        if gain > enough * (cost + gain):
            exact = False
        elif gain > 0.0 or refused > (3 if exact else 0):
            if exact or fresh <= 0:
                return Fit(theta, truth - here, jac)
            jac, damping = None, min(damping, 1e-2)


@njit(cache=True)
def gram(a, b):
    """a' b of two tall matrices, always summed in the same order (no threads)."""
    out = np.zeros((a.shape[1], b.shape[1]))
    for n in range(a.shape[0]):
        for i in range(a.shape[1]):
            for j in range(b.shape[1]):
                out[i, j] += a[n, i] * b[n, j]
    return out


@njit(cache=True)
def less(vectors, columns, shares):
    """vectors - columns @ shares."""
    out = vectors.copy()
    for n in range(out.shape[0]):
        for i in range(columns.shape[1]):
            for j in range(out.shape[1]):
                out[n, j] -= columns[n, i] * shares[i, j]
    return out


def basis(columns, least=1e-11):
    """Matrix that turns the columns into an orthonormal set; directions too weak are dropped."""
    norms = np.maximum(np.sqrt(np.sum(columns**2, axis=0)), 1e-30)
    power, turn = np.linalg.eigh(gram(columns, columns) / np.outer(norms, norms))
    keep = power > least * power[-1]
    return turn[:, keep] / np.sqrt(power[keep]) / norms[:, None]


def left_over(jac, vectors):
    """Vectors with everything that nominal parameters and nuisances can absorb taken out."""
    turn = basis(jac)
    for _ in range(2):  # the second pass removes the rounding of the first
        vectors = less(vectors, jac, turn @ (turn.T @ gram(jac, vectors)))
    return vectors


def cosine(signature, directions):
    """Cosine of the angle between a vector and the span of some others."""
    turn = basis(np.ascontiguousarray(directions))
    share = turn.T @ gram(directions, signature[:, None])
    return float(np.sqrt(np.sum(share**2) / np.sum(signature**2)))
