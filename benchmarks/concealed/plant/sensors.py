"""Noise of the sensors, and what else is imperfect about a recording."""

import numpy as np

from .recording import channels, measured

PLAIN = {"rho": 0.0, "sigma_phi": 2e-4, "dropout": 0.0, "jitter": 0.0, "spikes": 0.0}


def log_uniform(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def noise_spec(rng, setting, kind, override, soil=None):
    """sigma [m], rho of AR(1), blank share, time jitter [s], spike share, friction smoothing.

    Nulls carry imperfect nuisances more often, and some of them only nulls carry; `soil` (a
    generator) draws dirty noise for all.
    """
    null = kind == "null"
    low = 1e-5 if setting == "rectangles" else 5e-6
    spec = PLAIN | {"sigma": log_uniform(rng, low, 5e-5), "smooth_speed": 0.0}
    rho, dropout, smooth = rng.uniform(0.5, 0.9), rng.uniform(0.01, 0.03), rng.random()
    chance = rng.random(5)
    spec["rho"] = float(rho) if chance[0] < 0.5 else 0.0
    spec["dropout"] = float(dropout) if chance[1] < (0.5 if null else 0.2) else 0.0
    if null:
        spec["jitter"] = 1e-4 if chance[2] < 0.5 else 0.0
        spec["spikes"] = 0.002 if chance[3] < 0.25 else 0.0
        spec["smooth_speed"] = 5e-5 * 10.0 ** float(smooth) if chance[4] < 0.6 else 0.0
    spec = spec if soil is None else soiled(soil, spec)
    unknown = set(override or {}) - set(spec)
    if unknown:
        raise ValueError(f"unknown noise keys {sorted(unknown)}; known: {sorted(spec)}")
    return spec | (override or {})


def soiled(rng, spec):
    """White, coloured or dirty, a third each: dirty noise has blanks, outliers and lost rows."""
    kind = rng.integers(0, 3)
    if kind < 2:
        return spec | {"rho": float(kind * rng.uniform(0.5, 0.9)), "dropout": 0.0, "missing": 0.0}
    shares = {"dropout": (0.01, 0.03), "spikes": (5e-4, 3e-3), "missing": (2e-3, 0.01)}
    return spec | {n: float(rng.uniform(*bounds)) for n, bounds in shares.items()}


def bursts(rng, taken, share):
    """Blanks a share of the taken samples, in bursts of a few up to a few dozen."""
    rows, lost = np.flatnonzero(taken), 0
    taken = taken.copy()
    while lost < share * len(rows):
        length = int(rng.integers(3, 40))
        at = int(rng.integers(1, len(rows) - length - 1))
        taken[rows[at : at + length]] = False
        lost += length
    return taken


def draw_masks(rng, spec, runs, drive, zeroed=False):
    """Per run: channel -> (sigma, rho, which rows were taken, whether it has the inputs' zero)."""
    out = []
    for run in runs:
        grid = np.arange(len(run.ref)) % run.every == 0
        grid[list(run.missing)] = False
        seen = bursts(rng, grid, spec["dropout"])
        one = dict.fromkeys(("x", "y"), (spec["sigma"], spec["rho"], seen, zeroed))
        if drive == "dc":
            full = np.ones(len(run.ref), bool)
            full[list(run.missing)] = False
            one |= {f"phi{i}_meas": (spec["sigma_phi"], 0.0, full, False) for i in (1, 2)}
        out.append(one)
    return tuple(out)


def ar1(rng, n, rho):
    """Stationary AR(1) noise of unit variance."""
    e = rng.standard_normal(n)
    e[1:] *= np.sqrt(1.0 - rho * rho)
    for k in range(1, n if rho > 0.0 else 0):
        e[k] += rho * e[k - 1]
    return e


def noisy(rng, run, clean, masks, spec):
    """The channels as recorded."""
    out = dict(clean)
    for name in measured(clean):
        sigma, rho, taken, _ = masks[name]
        every = run.every if name in "xy" else 1
        grid = np.arange(0, len(taken), every)
        noise = sigma * ar1(rng, len(grid), rho)
        if name in "xy" and spec["spikes"] > 0.0:
            hit = rng.random(len(grid)) < spec["spikes"]
            noise += hit * rng.choice([-1.0, 1.0], len(grid)) * sigma * rng.uniform(8, 20)
        out[name] = clean[name].copy()
        out[name][grid] += noise
    return out


def jittered(rng, w, run, spec):
    """Channels whose x, y were sampled at slightly wrong instants."""
    shift = spec["jitter"] * rng.standard_normal(len(run.ref))
    return channels(w, run, jitter=shift if spec["jitter"] > 0.0 else None)
