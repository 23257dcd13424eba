"""Is the winner enough?  A test of what it leaves against simple functions of the motion.

No effect is assumed: direction, speed, acceleration, place, motor angle and their products are
regressed, all at once, on the whitened residual, after whatever the fit's own parameters can do has
been projected out.  Where a model is right, twice the gain is chi-square with as many degrees of
freedom as there are functions; a wrong model that fits "well enough" is far above.  Being summed
over the whole recording it sees a misfit of a tenth of the noise, which no omnibus test of
whiteness does (Godfrey, Misspecification Tests in Econometrics, 1988, doi:10.1017/CCOL0521266165).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from corexy_fmi.engine.data.samples import Run
from corexy_fmi.engine.fitting.fit import Fit
from corexy_fmi.kernel.call import Array

SHARP = 0.02  # share of the highest speed over which a direction turns
INDEPENDENT = 1e-4  # share of its own size that a function keeps after the projection
SURE, SHARE, LEAST = 5.25, 0.04, 25.0  # standard deviations; of the winner's gain; [nats]
TRACE = 1e-3  # share of the squares that the winner removes: 3 % of their size


STATES = {
    "direction": "velocity_reversal",
    "speed": "speed",
    "acceleration": "acceleration",
    "position": "position",
    "angle": "motor_angle",
}


@dataclass(frozen=True)
class Leftover:
    """What simple functions of the motion still explain: gain [nats] beyond chance, its standard
    score, and the function that alone explains most.
    """

    gain: float
    score: float
    cause: str
    channel: str = ""

    @property
    def place(self) -> tuple[str, str | None]:
        """Coordinate and state (CONTRACT 4) that the function points at."""
        motors = [n for n in ("motor 1", "motor 2") if n in self.cause]
        motors += [f"motor {self.channel[3]}"] if self.channel.startswith("phi") else []
        place = motors[0].replace(" ", "") if motors else self.channel[-1:]
        state = next((s for word, s in STATES.items() if word in self.cause), None)
        return place, state

    def matters(self, winner: float) -> bool:
        """Whether it stands out, beside what the winner gains [nats]."""
        return self.score > SURE and self.gain > max(LEAST, SHARE * winner)

    def is_trace(self, retuned: Fit, winner: Fit) -> bool:
        """Whether it is next to nothing of what the winner removes: of a cause of 94 um a gain, a
        logarithm, grows no more with its size, but what a form leaves of it does.
        """
        return self.gain < TRACE * removed(retuned, winner)


NOTHING = Leftover(0.0, 0.0, "")


def removed(before: Fit, after: Fit) -> float:
    """Half of the squares [nats] that one fit removes of another's errors, under its own noise."""
    problem = replace(before.problem, noise=after.problem.noise)
    old = problem.residual(before.u[None])[0][: problem.parts[-1].stop]
    new = after.residual[: after.problem.parts[-1].stop]
    return 0.5 * float(old @ old - new @ new)


def functions(run: Run) -> dict[str, Array]:
    """Functions (rows,) of the commanded motion by their name; none where voltages command it."""
    e = run.excitation
    if e.mode == "voltages":
        return {}
    angle = {"motor 1": e.input1, "motor 2": e.input2}
    place = {"x": (e.input1 + e.input2) / 2, "y": (e.input1 - e.input2) / 2}
    speed = {n: np.gradient(v, e.time) for n, v in (angle | place).items()}
    turn = {n: np.tanh(v / (SHARP * np.abs(v).max() + 1e-9)) for n, v in speed.items()}
    found = {f"direction of {n}": v for n, v in turn.items()}
    found |= {f"speed of {n}": speed[n] for n in angle}
    found |= {f"squared speed of {n}": speed[n] ** 2 for n in angle}
    found["product of the speeds"] = speed["x"] * speed["y"]
    found |= {f"position {n}": v for n, v in place.items()}
    found |= {f"position {a}{b}": place[a] * place[b] for a, b in ("xx", "yy", "xy")}
    found |= {f"acceleration of {n}": np.gradient(speed[n], e.time) for n in place}
    found |= {f"direction of {a} by position {b}": turn[a] * place[b] for a in place for b in place}
    for n, phi in angle.items():
        for k in (1, 2):
            word = f"angle of {n}" if k == 1 else f"twice the angle of {n}"
            found |= {f"{word}, sine": np.sin(k * phi), f"{word}, cosine": np.cos(k * phi)}
    return found


def leftover(fit: Fit) -> Leftover:
    """What a settled fit leaves to simple functions of the motion."""
    runs = [(functions(run), run) for run in fit.problem.runs]
    if not all(table for table, _ in runs) or not np.isfinite(fit.cost):
        return NOTHING
    own, _ = np.linalg.qr(fit.jacobian)
    channels = sorted({s.channel for run in fit.problem.runs for s in run.samples})
    names = [(c, n) for c in channels for n in runs[0][0]]
    normal, reach = np.zeros((len(names),) * 2), np.zeros((len(names), own.shape[1]))
    pull, at = np.zeros(len(names)), 0
    for r, (table, _) in enumerate(runs):
        values = np.array(list(table.values()))
        for f in fit.problem.filters[r]:
            white = f.white(values[:, f.samples.rows])
            here = slice(at, at := at + white.shape[1])
            rows = slice(
                first := channels.index(f.samples.channel) * len(table), first + len(table)
            )
            normal[rows, rows] += white @ white.T
            reach[rows] += white @ own[here]
            pull[rows] += white @ fit.residual[here]
    size = np.diag(normal) + 1e-300
    normal -= reach @ reach.T
    pull -= reach @ (own.T @ fit.residual)
    return judged(normal, pull, size, names)


def judged(normal: Array, pull: Array, size: Array, names: list[tuple[str, str]]) -> Leftover:
    """Joint gain of all functions that the projection leaves anything of."""
    kept = np.diag(normal) > INDEPENDENT * size
    if not kept.any():
        return NOTHING
    scale = 1 / np.sqrt(np.diag(normal)[kept])
    pull, normal = pull[kept] * scale, normal[np.ix_(kept, kept)] * scale[:, None] * scale
    power, turn = np.linalg.eigh(normal)
    strong = power > INDEPENDENT
    gain = 0.5 * float(np.sum((turn[:, strong].T @ pull) ** 2 / power[strong]))
    chance = 0.5 * float(strong.sum())
    channel, cause = [n for n, k in zip(names, kept, strict=True) if k][np.argmax(np.abs(pull))]
    return Leftover(gain - chance, (gain - chance) / np.sqrt(chance), cause, channel)
