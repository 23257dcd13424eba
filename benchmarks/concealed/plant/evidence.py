"""E and E_sep: what the retuned nominal model cannot explain, in the plant's own code.

E = min over nominal parameters and nuisances of (s - m)' S^-1 (s - m), with s the noise-free
truth, m the nominal model, S the noise covariance. A constant offset of each measured channel
is projected out; nominal parameters and initial belt deflections are fitted by Gauss-Newton.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from .machines import pack
from .recording import channels, measured

FACTOR = 2.5  # a nominal parameter stays within this factor of its base value
WEAK = 1e-2 / 0.2**2  # ridge towards the base machine: settles what the data cannot decide
DEFLECTION, WEAK_DEFLECTION = 1e-5, 1e-3
DIFFERENCE = 4e-3


@dataclass(frozen=True)
class Experiment:
    """Recordings, their noise, and the base machine that a nominal model starts from."""

    drive: str
    base: dict
    free: tuple
    runs: tuple
    noise: tuple  # per run: channel -> (sigma, rho, taken mask)


@njit(cache=True)
def whiten(values, sigma, rho, taken):
    """Exact whitening of AR(1) noise with blanks, a constant offset projected out.

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
    for k in range(len(rows)):
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

    theta: log of the free parameters over the base machine's, then the log sizes of the given
    effects, then the initial deflections (in units of 10 um).
    """

    def __init__(self, experiment, beside=()):
        self.experiment, self.beside = experiment, tuple(beside)
        self.n_nominal = len(experiment.free)
        self.n_machine = self.n_nominal + len(self.beside)
        self.size = self.n_machine + 2 * len(experiment.runs)
        self.weak = np.full(self.size, WEAK)
        self.weak[self.n_nominal : self.n_machine] = 0.0
        self.weak[self.n_machine :] = WEAK_DEFLECTION

    def start(self, values):
        """theta of a machine, with the deflections of the runs and the sizes as they are."""
        base = self.experiment.base
        logs = [np.log(values[n] / base[n]) for n in self.experiment.free]
        bends = np.concatenate([r.deflection for r in self.experiment.runs]) / DEFLECTION
        return np.concatenate([logs, np.zeros(len(self.beside)), bends])

    def values(self, theta):
        out = dict(self.experiment.base)
        for name, log in zip(self.experiment.free, theta, strict=False):
            out[name] = out[name] * float(np.exp(log))
        return out

    def machine(self, theta, more=None):
        """Kernel array at theta; `more`: slots of one more effect."""
        slots = dict(more or {})
        sizes = np.exp(theta[self.n_nominal : self.n_machine])
        for planted, factor in zip(self.beside, sizes, strict=True):
            slots |= planted.scaled(factor).slots()
        return pack(self.values(theta), self.experiment.drive, slots)

    def deflections(self, theta):
        return theta[self.n_machine :].reshape(-1, 2) * DEFLECTION

    def output_run(self, theta, k, more=None):
        """Whitened channels of run k."""
        w, bend = self.machine(theta, more), self.deflections(theta)[k]
        shown = channels(w, self.experiment.runs[k], bend)
        return whitened_run(shown, self.experiment.noise[k])

    def output(self, theta, more=None):
        runs = range(len(self.experiment.runs))
        return np.concatenate([self.output_run(theta, k, more) for k in runs])

    def jacobian(self, theta, here):
        """Finite differences; a deflection moves its own recording only."""
        out = np.zeros((len(here), self.size))
        lengths = [
            sum(int(np.sum(n[2])) for n in noise.values()) for noise in self.experiment.noise
        ]
        ends = np.cumsum(lengths)
        for i in range(self.size):
            nominal = i < self.n_machine
            moved = theta.copy()
            moved[i] += DIFFERENCE if nominal else 0.1
            if nominal:
                out[:, i] = (self.output(moved) - here) / DIFFERENCE
            else:
                k = (i - self.n_machine) // 2
                own = slice(ends[k] - lengths[k], ends[k])
                out[own, i] = (self.output_run(moved, k) - here[own]) / 0.1
        return out

    def clip(self, theta):
        theta = theta.copy()
        limit = np.log(FACTOR)
        theta[: self.n_nominal] = np.clip(theta[: self.n_nominal], -limit, limit)
        theta[self.n_machine :] = np.clip(theta[self.n_machine :], -30.0, 30.0)
        return theta

    def newton_step(self, jac, residual, theta):
        """Step of the ridge problem; jac' jac is scaled first, for its wide range."""
        normal = gram(jac, jac) + np.diag(self.weak)
        scale = 1.0 / np.sqrt(np.diag(normal))
        right = gram(jac, residual[:, None])[:, 0] - self.weak * theta
        scaled = normal * scale[:, None] * scale + 1e-12 * np.eye(self.size)
        return scale * np.linalg.solve(scaled, scale * right)

    def cost(self, residual, theta):
        return float(np.sum(residual**2) + np.sum(self.weak * theta**2))


def fit(model, truth, theta, here, jac=None, rounds=6, fresh=2):
    """Gauss-Newton from theta, where the output is `here`; a Jacobian is reused while it pays.

    Returns theta, residual and the last Jacobian; at most `fresh` Jacobians are computed.
    """
    cost = model.cost(truth - here, theta)
    for _ in range(rounds):
        made = jac is None
        if made:
            jac, fresh = model.jacobian(theta, here), fresh - 1
        before = cost
        move = model.newton_step(jac, truth - here, theta)
        for shrink in (1.0, 0.4, 0.1):
            trial = model.clip(theta + shrink * move)
            there = model.output(trial)
            tried = model.cost(truth - there, trial)
            if tried < cost:
                theta, here, cost = trial, there, tried
                break
        if before - cost < 0.003 * before:
            if made or fresh <= 0:
                break
            jac = None
    return theta, truth - here, jac


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
