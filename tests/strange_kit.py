"""Short recordings of drawn stages; those with dc motors, and the exact course of one without dry
friction.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from scipy.linalg import expm

from benchmarks.strange import draw, machines, moves, sensing
from benchmarks.strange.cause import About


@contextmanager
def short_recordings() -> Iterator[None]:
    """Recordings of a second or two, for speed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(moves, "SECONDS", (1.2, 1.5))
        yield


def turned(seed):
    """A machine, and the sensor beside its loop."""
    stages, sensor = draw.generator(seed, 0), sensing.draw_sensor(draw.generator(seed, 1))
    return draw._turned(draw.generator(seed, 6), machines.draw_machine(stages), stages, sensor)


def about(seed):
    """A machine and short motions for it."""
    (machine, sensor), random = turned(seed), draw.generator(seed, 2)
    cut = [moves.draw_motion(random, machine, kind, sensor.row) for kind in ("star", "zigzag")]
    return About(machine, [(time[:1500], xy[:1500]) for time, xy in cut])


def stretches(q, r):
    """The parentheses of (6), each with the place of its stiffness in k_1 .. k_5."""
    x, y, p = q[0], q[1], np.concatenate([[0], r * q[2:]])
    return [(p[3] + x, 0), (p[4] + x, 0), (p[6] - x, 0), (p[5] - x, 0), (p[3] + p[1] - y, 1),
            (p[4] + p[2] + y, 1), (p[9] - p[1], 2), (p[10] - p[2], 2), (p[9] - p[8], 3),
            (p[10] - p[7], 3), (p[8] - p[6] - y, 4), (p[7] - p[5] + y, 4)]  # fmt: skip


def exact(n, ref, row):
    """x, y [m] of (4), (6), (7) without dry friction, voltages held from row to row: no steps."""
    near, half = (n["W"] - n["c"]) / 2, n["H"] / 2
    k = n["AE"] / np.array([near, half, n["H"], n["W"], half])
    unit = [stretches(e, n["r"]) for e in np.eye(12)]
    table = np.array([[s for s, _ in column] for column in unit]).T
    belts = table.T @ (k[[i for _, i in unit[0]]][:, None] * table)
    mass = np.array([n["mx"], n["my"] + n["mx"] + 4 * n["mp"], *[n["J"]] * 2, *[n["Jp"]] * 8])
    drag = np.array([n["bx"], n["by"], *[n["Bp"] + n["K2"]] * 2, *[n["Bp"]] * 8])
    whole = np.zeros((26, 26))
    whole[:12, 12:24], whole[12:24, :12] = np.eye(12), -belts / mass[:, None]
    whole[12:24, 12:24], whole[[14, 15], [24, 25]] = -np.diag(drag / mass), n["K1"] / n["J"]
    on, z, seen = expm(whole * row), np.zeros(26), []
    z[:12] = np.linalg.lstsq(np.vstack([table, np.eye(12)[2:4]]), [*[0.0] * 12, *ref[0]])[0]
    for now, after in zip(ref, np.vstack([ref[1:], ref[-1:]]), strict=True):
        seen.append(z[:2].copy())
        z[24:] = n["kp"] * (now - z[2:4]) + n["kd"] * ((after - now) / row - z[14:16])
        z = on @ z
    return np.array(seen)
