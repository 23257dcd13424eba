"""The force on x and y that an effect adds, along the true motion."""

import numpy as np
from numba import njit

from .kernel import accelerate
from .laws import dry_level
from .layout import EXTRA, NOW, PUSH, SLOT, A, F, Q, V
from .machines import pack
from .motions import STEP
from .recording import per_recording, trajectory
from .scale import true_machine

KIND, SIZE = SLOT["odd_kind"], SLOT["odd_size"]
FORCE_X = SLOT["force_x"]


@njit(cache=True)
def stage_forces(w, qs, vs):
    """Forces on x, y but dry friction at given states; dry friction beyond the known levels."""
    out, extra = np.empty((qs.shape[0], 2)), np.empty((qs.shape[0], 2))
    for n in range(qs.shape[0]):
        for i in range(qs.shape[1]):
            w[Q + i], w[V + i] = qs[n, i], vs[n, i]
        w[NOW] = n * STEP
        w[PUSH], w[PUSH + 1] = w[FORCE_X], w[FORCE_X + 1]
        accelerate(w, Q, V, F, A, 0.0)
        out[n, 0], out[n, 1] = w[F], w[F + 1]
        extra[n, 0], extra[n, 1] = w[EXTRA], w[EXTRA + 1]
    return out, extra


@njit(cache=True)
def extra_friction(w, plain, forces, extra, vs, modes):
    """Dry friction on x, y beyond what the plain machine's could be at the same instant."""
    out = np.zeros((vs.shape[0], 2))
    for n in range(vs.shape[0]):
        for i in range(2):
            most, w[EXTRA + i] = dry_level(plain, i, 0.0), extra[n, i]
            if modes[n, i] == 0.0:
                over = max(abs(forces[n, i]) - most, 0.0)
                out[n, i] = -over if forces[n, i] > 0.0 else over
            else:
                out[n, i] = -modes[n, i] * (dry_level(w, i, vs[n, i]) - most)
    return out


def along(w, plain, run):
    """Added force, speed, and whether it slides the same way all about a row, columns x and y."""
    qs, vs, modes, _ = trajectory(w, run)
    w = per_recording(w, run)
    forces, extra = stage_forces(w.copy(), qs, vs)
    added = forces - stage_forces(plain.copy(), qs, vs)[0]
    if w[KIND] >= 7.0:
        added[:, int(w[KIND]) - 7] += w[SIZE] * run.gusts[:, int(w[KIND]) - 7]
    added += extra_friction(w.copy(), plain, forces, extra, vs, modes)
    mode = np.pad(modes[:, :2], ((1, 1), (0, 0)), "edge")
    slides = (mode[1:-1] != 0.0) & (mode[1:-1] == mode[:-2]) & (mode[1:-1] == mode[2:])
    return added, vs[:, :2], slides


def planted_force(world, planted):
    """Per training run: time [s], added force [N] on x, y, speed [m/s] and where it slides; None
    where no force acts there."""
    if not planted or not all(one.effect.on_stage for one in planted):
        return None
    w = true_machine(world, planted)
    plain = pack(world.values, world.drive)
    forces, speeds, slides = zip(*(along(w, plain, run) for run in world.runs[:2]), strict=True)
    time = [np.arange(len(f)) * STEP for f in forces]
    return {"time": time, "force": forces, "speed": speeds, "slides": slides}
