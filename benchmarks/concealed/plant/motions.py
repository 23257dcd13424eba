"""Motions inside the stage: reference motor angles at 1 kHz for three settings."""

import math

import numpy as np

STEP, MARGIN = 1e-3, 0.012
# per base machine: slowest and fastest speed [m/s], accelerations [m/s^2] (inf: constant speed)
PACE = {
    "yin2018": (0.02, 0.08, (math.inf, math.inf, 2.0)),
    "light_bench": (0.02, 0.08, (math.inf, 1.0, 3.0)),
    "gt2_printer": (0.03, 0.15, (0.7, 1.5, 3.0)),
}


def travelled(length, speed, accel):
    """Arc length at every row of a stretch that starts and ends at rest; ends on a row."""
    ramp = min(speed / accel, math.sqrt(length / accel))
    top = speed if ramp == 0.0 else min(speed, ramp * accel)
    rows = max(2, math.ceil((length / top + ramp) / STEP))
    t = np.arange(1, rows + 1) / rows * (length / top + ramp)
    if ramp == 0.0:
        return length * np.arange(1, rows + 1) / rows
    end = t[-1]
    rise, fall = np.minimum(t, ramp), np.clip(t - (end - ramp), 0.0, ramp)
    return 0.5 * accel * rise**2 + top * np.maximum(t - ramp, 0.0) - 0.5 * accel * fall**2


class Pen:
    """Draws a motion as rows of x, y; every method appends a stretch."""

    def __init__(self, start, accel):
        self.rows, self.accel = [np.array([start], float)], accel

    @property
    def here(self):
        return self.rows[-1][-1]

    def seconds(self):
        return STEP * sum(len(r) for r in self.rows)

    def rest(self, seconds):
        self.rows.append(np.repeat(self.here[None], round(seconds / STEP), axis=0))

    def line(self, to, speed):
        way = np.asarray(to, float) - self.here
        length = float(np.hypot(*way))
        if length > 1e-9:
            share = travelled(length, speed, self.accel) / length
            self.rows.append(self.here + share[:, None] * way)

    def path(self, points, speed):
        for point in points:
            self.line(point, speed)

    def circle(self, radius, speed):
        centre = self.here - [radius, 0.0]
        angle = travelled(2 * math.pi * radius, speed, self.accel) / radius
        self.rows.append(centre + radius * np.column_stack([np.cos(angle), np.sin(angle)]))

    def chirp(self, size, way, fast):
        t = STEP * np.arange(1, 1501)
        window = np.sin(math.pi * t / t[-1]) ** 2
        swing = size * window * np.sin(2 * math.pi * (t + (fast - 1.0) * t**2 / (2 * t[-1])))
        self.rows.append(self.here + swing[:, None] * np.asarray(way))


def stage_half(values):
    near = (values["bridge_pulley_spacing"] - values["clip_spacing"]) / 2
    return np.array([near, values["motor_idler_span"] / 2]) - MARGIN


def rectangle(pen, rng, half, speed):
    size = rng.uniform(0.25, 0.8, 2) * np.minimum(half, 0.06)
    centre = rng.uniform(-1, 1, 2) * (half - size) * 0.9
    corners = centre + size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    pen.path(corners, speed)


def star(pen, rng, half, speed):
    radius, turn = rng.uniform(0.3, 0.8) * min(*half, 0.06), rng.uniform(0, 2 * math.pi)
    centre = rng.uniform(-1, 1, 2) * (half - radius)
    angles = turn + 2 * math.pi * 2 / 5 * np.arange(6)
    pen.path(centre + radius * np.column_stack([np.cos(angles), np.sin(angles)]), speed)


def round_trip(pen, rng, half, speed):
    radius = rng.uniform(0.25, 0.7) * min(*half, 0.05)
    centre = rng.uniform(-1, 1, 2) * (half - radius)
    pen.line(centre + np.array([radius, 0.0]), speed)
    pen.circle(radius, speed)


def wander(pen, rng, half, speed):
    pen.path(rng.uniform(-1, 1, (3, 2)) * half, speed)


def wobble(pen, rng, half, speed):
    fast = rng.uniform(6.0, 12.0)
    size = min(speed / (2 * math.pi * fast), 0.002)
    pen.line(rng.uniform(-1, 1, 2) * (half - 0.005), speed)
    pen.chirp(size, (1.0, rng.choice([-0.6, 0.6])), fast)
    pen.chirp(size, (rng.choice([-0.6, 0.6]), 1.0), fast)


def angles(pen, values):
    x, y = np.concatenate(pen.rows).T
    return np.column_stack([x + y, x - y]) / values["pulley_radius"]


def draw_motion(rng, setting, name, values, seconds):
    """Reference angles of one recording, at least `seconds` long."""
    slow, fast, accels = PACE[name]
    half = stage_half(values)
    accel = accels[0] if setting == "rectangles" else rng.choice(accels)
    pen = Pen(rng.uniform(-0.3, 0.3, 2) * half, accel)
    pen.rest(0.3)
    shapes = [rectangle, star, round_trip, wobble, wander]
    order = [rectangle] if setting == "rectangles" else list(rng.permutation(shapes))
    while pen.seconds() < seconds:
        speed = math.exp(rng.uniform(math.log(slow), math.log(fast)))
        order[0](pen, rng, half, speed)
        pen.rest(rng.uniform(0.2, 0.5))
        order = order[1:] + order[:1]
    return angles(pen, values)
