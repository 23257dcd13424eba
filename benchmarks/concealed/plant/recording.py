"""One run of a machine: what the sensors would show, without and with their noise."""

import io
from dataclasses import dataclass

import numpy as np
from numba import njit

from .layout import SLOT, YAW
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
    onset: float = 0.0  # when a warm-up sets in, from the recording's start [s]
    phase: float = 0.0  # of a periodic force [rad]
    lost_at: float = 4.0  # when steps are missed [s] ...
    times_lost: int = 1  # ... and how often those that are planted
    missing: tuple = ()  # rows that the file lacks

    @property
    def time(self):
        return np.arange(len(self.ref)) * STEP


FINE = 4  # rows of a ms where a command has errors between its samples


def commanded(w, run):
    """Angles that the rotors are told, with errors of the driver; and the rows in a ms."""
    errors = [w[SLOT[n]] for n in ("microstep1", "microstep2", "lost1", "lost2")]
    if not any(errors):
        return run.ref, 1
    t = np.arange(FINE * (len(run.ref) - 1) + 1) * (STEP / FINE)
    ref = np.column_stack([np.interp(t, run.time, one) for one in run.ref.T])
    phase, share = w[SLOT["microstep_phase"]], 0.3 * w[SLOT["microstep_form"]]
    since = (t - w[SLOT["lost_time"]]) / (0.008 if w[SLOT["lost_form"]] else 0.002)
    gone = np.clip(since, 0.0, 1.0)
    if w[SLOT["lost_form"]]:
        gone = 0.5 - 0.5 * np.cos(np.pi * gone)
    for i in range(2):
        angle = ref[:, i].copy()
        for n, part in ((50.0, 1.0), (200.0, share)):
            ref[:, i] += errors[i] * part * (np.sin(n * angle + phase) - np.sin(phase))
        ref[:, i] -= errors[2 + i] * np.radians(1.8) * gone
    return ref, FINE


def per_recording(w, run):
    """The machine with what belongs to one recording."""
    w = w.copy()
    w[SLOT["warm_onset"]], w[SLOT["lost_time"]] = run.onset, run.lost_at
    w[SLOT["beat_phase"]] += run.phase
    for name in ("lost1", "lost2"):
        w[SLOT[name]] *= run.times_lost
    return w


def turned(w, angles):
    """Rotors at rest on their magnetic springs, pulled aside by their cogging."""
    torque, spring = w[SLOT["detent"]], w[SLOT["holding_torque"]]
    if torque == 0.0 or spring == 0.0:
        return angles
    out = angles
    for _ in range(20):
        pull = torque * np.sin(w[SLOT["detent_order"]] * out + w[SLOT["detent_phase"]])
        out = 0.5 * (out + angles - np.arcsin(np.clip(pull / spring, -1.0, 1.0)) / 50.0)
    return out


def leaning(w, angles, deflection):
    """Where a constant force, which was there before the recording, holds rotors and belts: all
    belts as long as nominal, rotors held by their magnetic springs or by the loop.
    """
    force = np.array([w[SLOT["force_x"]], w[SLOT["force_y"]]])
    if not force.any():
        return angles, deflection
    near = (w[SLOT["bridge_pulley_spacing"]] - w[SLOT["clip_spacing"]]) / 2
    high, wide = w[SLOT["motor_idler_span"]], w[SLOT["bridge_pulley_spacing"]]
    parts = 1.0 / (near + high / 2), 1.0 / (high * 1.5 + wide + near)
    sections = w[SLOT["belt_axial_stiffness"]] * sum(parts)
    spring = 50.0 * w[SLOT["holding_torque"]]
    if w[SLOT["dc"]] != 0.0:
        spring = w[SLOT["motor_torque_gain"]] * w[SLOT["kp"]]
    torque = w[SLOT["pulley_radius"]] / 2 * np.array([force.sum(), force[0] - force[1]])
    turn = torque / spring if spring > 0.0 else np.zeros(2)
    return angles + turn, np.asarray(deflection) + force / (2.0 * sections)


def rest_position(w, angles, deflection):
    """Coordinates at rest: idlers in static balance between the motors and the end-effector."""
    r, (a1, a2), (dx, dy) = w[SLOT["pulley_radius"]], angles, deflection
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
    w = per_recording(w, run)
    ref, fine = commanded(w, run)
    bend = run.deflection if deflection is None else deflection
    q0 = rest_position(w, *leaning(w, turned(w, ref[0]), bend))
    gaps = w[SLOT["gap1"] : SLOT["gap1"] + 2]
    memory = 0.5 * run.play * gaps + (ref[0] if w[SLOT["gap_form"]] == 1.0 else 0.0)
    blown = w[SLOT["odd_kind"]] in (7.0, 8.0)
    outer = run.gusts * (w[SLOT["odd_size"]] if blown else 0.0)
    if blown:
        outer = outer * (np.arange(2) == w[SLOT["odd_kind"]] - 7.0)
    if fine > 1:
        outer = np.repeat(outer, fine, axis=0)
    steps = -(-steps_per_ms(w) // fine)
    return tuple(a[::fine] for a in simulate(w, STEP / fine, ref, outer, q0, memory, steps))


@njit(cache=True, nogil=True)
def lagged(values, time_constant, digital):
    """A first-order filter, and its slope; exact for lines between rows, or backward Euler."""
    out, slope = values.copy(), np.zeros(len(values))
    share = STEP / time_constant
    fade = np.exp(-share)
    for n in range(1, len(values)):
        if digital:
            out[n] = (out[n - 1] + share * values[n]) / (1.0 + share)
        else:
            rise = (values[n] - values[n - 1]) / share
            out[n] = values[n] - rise + fade * (out[n - 1] - values[n - 1] + rise)
        slope[n] = (values[n] - out[n]) / time_constant
    return out, slope


def channels(w, run, deflection=None, jitter=None):
    """Noise-free channels of a run, each with a value at every row."""
    q, v, _, rest = trajectory(w, run, deflection)
    first = 12 if w[SLOT["tool_mass"]] > 0.0 else 0
    x, y, vx, vy = q[:, first], q[:, first + 1], v[:, first], v[:, first + 1]
    if w[SLOT["rack_stiffness"]] > 0.0:
        y, vy = y + q[:, YAW] * x, vy + v[:, YAW] * x + q[:, YAW] * vx
    if w[SLOT["lag"]] > 0.0:
        (x, vx), (y, vy) = (lagged(a, w[SLOT["lag"]], w[SLOT["lag_form"]] == 1.0) for a in (x, y))
    late, drift = w[SLOT["delay"]], w[SLOT["drift"]]
    if late != 0.0 or jitter is not None or drift != 0.0:
        when = run.time * (1.0 + drift) - late + (0.0 if jitter is None else jitter)
        x, y = at_times(run.time, x, vx, when), at_times(run.time, y, vy, when)
    x = x - w[SLOT["skew"]] * y + w[SLOT["bow"]] * y**2
    turn = w[SLOT["rotation"]]
    x, y = x - turn * y, y + turn * x
    x, y = x * (1.0 + w[SLOT["scale_x"]]), y * (1.0 + w[SLOT["scale_y"]])
    out = {"x": x, "y": y}
    if w[SLOT["dc"]] != 0.0:
        out |= {"V1": rest[:, 2], "V2": rest[:, 3], "phi1_meas": q[:, 2], "phi2_meas": q[:, 3]}
    return out


def measured(names):
    return [n for n in names if n not in ("V1", "V2")]


def csv_text(run, shown, taken, drive, zeroed=False):
    """A recording; cells that were not taken are blank; `zeroed`: x, y have the inputs' zero."""
    out = io.StringIO()
    if zeroed:
        out.write("# zero: x, y\n")
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
    rows = enumerate(zip(*columns, strict=True))
    out.writelines(",".join(row) + "\n" for k, row in rows if k not in run.missing)
    return out.getvalue()
