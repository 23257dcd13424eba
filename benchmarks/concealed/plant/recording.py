"""One run of a machine: what the sensors would show, without and with their noise."""

import io
from dataclasses import dataclass

import numpy as np

from .layout import SLOT
from .machines import GAINS, steps_per_ms
from .motions import STEP
from .solver import simulate


@dataclass(frozen=True)
class Run:
    """A motion with all that belongs to one recording."""

    ref: np.ndarray  # reference motor angles, one row per ms
    deflection: tuple  # x, y of the resting belts at the start, off eq. (1) [m]
    play: float  # where a loose pulley starts in its gap, -1 .. 1
    gusts: np.ndarray  # unit pattern of a random force on x, y
    every: int  # x, y are sampled at each so many rows

    @property
    def time(self):
        return np.arange(len(self.ref)) * STEP


def rest_position(w, run, deflection):
    """Coordinates at rest: idlers in static balance between the motors and the end-effector."""
    r, (a1, a2), (dx, dy) = w[SLOT["pulley_radius"]], run.ref[0], deflection
    x, y = r * (a1 + a2) / 2 + dx, r * (a1 - a2) / 2 + dy
    near = (w[SLOT["bridge_pulley_spacing"]] - w[SLOT["clip_spacing"]]) / 2
    high, wide = w[SLOT["motor_idler_span"]], w[SLOT["bridge_pulley_spacing"]]
    q = np.zeros(14)
    q[[0, 1, 12, 13]] = x, y, x, y
    q[2:4] = a1, a2
    for side, motor, (i3, i9, i8, i6) in ((1, a1, (3, 9, 8, 6)), (-1, a2, (4, 10, 7, 5))):
        mx, travel = side * x, side * r * motor
        # stretches share the total of their branch by length (equal tension)
        low = (mx + y - travel) / (near + high / 2)
        top = (travel - y - mx) / (high * 1.5 + wide + near)
        t3 = low * near - mx
        t9 = travel - top * high
        t8 = t9 - top * wide
        t6 = t8 - y - top * high / 2
        for i, t in ((i3, t3), (i9, t9), (i8, t8), (i6, t6)):
            q[i + 1] = side * t / r
    return q


def at_times(time, values, slopes, when):
    """Cubic Hermite interpolation; before the first row the run rests."""
    when = np.clip(when, time[0], time[-1])
    k = np.minimum((when / STEP).astype(int), len(time) - 2)
    u = (when - time[k]) / STEP
    a, b = values[k], values[k + 1]
    da, db = slopes[k] * STEP, slopes[k + 1] * STEP
    curve = a + u * da + u**2 * (3 * (b - a) - 2 * da - db) + u**3 * (2 * (a - b) + da + db)
    return curve


def trajectory(w, run, deflection=None):
    """Raw states of a run: q, v, modes and (memory, volts) at every row."""
    q0 = rest_position(w, run, run.deflection if deflection is None else deflection)
    gaps = w[SLOT["gap1"] : SLOT["gap1"] + 2]
    memory = 0.5 * run.play * gaps + (run.ref[0] if w[SLOT["gap_form"]] == 1.0 else 0.0)
    blown = w[SLOT["odd_kind"]] in (7.0, 8.0)
    outer = run.gusts * (w[SLOT["odd_size"]] if blown else 0.0)
    if blown:
        outer = outer * (np.arange(2) == w[SLOT["odd_kind"]] - 7.0)
    return simulate(w, STEP, run.ref, outer, q0, memory, steps_per_ms(w))


def channels(w, run, deflection=None, jitter=None):
    """Noise-free channels of a run, each with a value at every row."""
    q, v, _, rest = trajectory(w, run, deflection)
    first = 12 if w[SLOT["tool_mass"]] > 0.0 else 0
    x, y = q[:, first], q[:, first + 1]
    late = w[SLOT["delay"]]
    if late != 0.0 or jitter is not None:
        when = run.time - late + (0.0 if jitter is None else jitter)
        x = at_times(run.time, x, v[:, first], when)
        y = at_times(run.time, y, v[:, first + 1], when)
    x = x - w[SLOT["skew"]] * y + w[SLOT["bow"]] * y**2
    out = {"x": x, "y": y}
    if w[SLOT["dc"]] != 0.0:
        out |= {"V1": rest[:, 2], "V2": rest[:, 3], "phi1_meas": q[:, 2], "phi2_meas": q[:, 3]}
    return out


def measured(names):
    return [n for n in names if n not in ("V1", "V2")]


def csv_text(run, shown, taken, drive):
    """A recording; cells that were not taken are blank."""
    out = io.StringIO()
    if drive == "dc":
        out.write(f"# controller: pd kp={GAINS['kp']!r} kd={GAINS['kd']!r}\n")
    order = [n for n in ("V1", "V2", "phi1_meas", "phi2_meas", "x", "y") if n in shown]
    out.write(",".join(["time", "phi1", "phi2", *order]) + "\n")
    columns = [[repr(round(k * STEP, 9)) for k in range(len(run.ref))]]
    columns += [[repr(a) for a in run.ref[:, i].tolist()] for i in range(2)]
    for name in order:
        cells = [repr(a) for a in shown[name].tolist()]
        if name in taken:
            cells = [c if t else "" for c, t in zip(cells, taken[name].tolist(), strict=True)]
        columns.append(cells)
    out.writelines(",".join(row) + "\n" for row in zip(*columns, strict=True))
    return out.getvalue()
