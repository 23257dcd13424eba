"""Loops of a motion: found, their noise, what drifts between them."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import BACKLASH, machine, other_motion, record, rich_motion, with_effects

from corexy_fmi.engine.data.samples import make_run
from corexy_fmi.engine.evidence import Evidence
from corexy_fmi.engine.fitting.noise import white
from corexy_fmi.engine.fitting.quiet import own_models
from corexy_fmi.engine.judging.prove import Proof, replay
from corexy_fmi.engine.judging.repeats import as_rows, repeated, repeating
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.motion import chain, rest
from corexy_fmi.rectangle import Rectangle
from corexy_fmi.report.notices import make_notices

LOOPS, NOISE = 8, 1e-5
SIDE = Rectangle(0.012, 0.008, 0.05, LOOPS)
PERIOD = 2 * (0.012 + 0.008) / 0.05


def looped(truth=None, noise=NOISE, change=lambda t, v: v, channels=("x", "y")):
    """Loops of a rectangle whose measurement of x is changed by a function of time."""
    made = record(
        truth or machine(),
        chain(rest(SIDE.vertices[0], 0.1), SIDE.motion),
        noise=noise,
        channels=channels,
    )
    return replace(made, channels={**made.channels, "x": change(made.time, made["x"])})


def proof(recording, nominal=None):
    """The replay of a machine as it is, in the place of the retuned one."""
    chosen = nominal or machine()
    run = make_run(recording, chosen, "train")
    noise = tuple(white(NOISE) for _ in run.samples)
    replayed = replay(bundled_layout(), chosen, run, noise)
    return Proof((run,), {"retuned": (replayed,)}, ((NOISE, NOISE),))


def test_loops_are_found():
    found = make_run(looped(), machine(), "train").loops
    assert found.count == LOOPS
    assert found.period == pytest.approx(PERIOD, abs=2e-3)


@pytest.mark.parametrize("motion", [rich_motion(), other_motion(), rest((0, 0), 3.0)])
def test_what_does_not_repeat_has_none(motion):
    run = make_run(record(machine(), motion), machine(), "train")
    assert run.loops is None


def test_noise_is_told_from_a_mismatch_that_comes_back():
    """Backlash that the model lacks repeats in every loop; the loops differ by noise alone."""
    shown = proof(looped(with_effects(machine(), BACKLASH)))
    x = next(r for _, r in repeated(shown) if r.channel == "x")
    assert x.noise.marginal == pytest.approx(NOISE, rel=0.1)
    assert x.ratio > 2
    assert "times what differs between the 8 loops" in repeating(shown)


def test_noise_alone_is_no_mismatch_and_does_not_drift():
    for seed in range(3):
        shown = proof(replace(looped(change=lambda t, v: v), name=f"{seed}"))
        assert repeating(shown) == ""
        assert [row["drift"] for row in as_rows(shown)] == [None, None]


def test_colour_is_that_of_the_noise():
    random = np.random.default_rng(3)

    def coloured(time, values):
        noise = np.zeros(len(time))
        for n in range(1, len(time)):
            noise[n] = 0.8 * noise[n - 1] + 0.6 * NOISE * random.normal()
        return values + noise

    x = next(r for _, r in repeated(proof(looped(noise=0.0, change=coloured))) if r.channel == "x")
    assert x.noise.marginal == pytest.approx(NOISE, rel=0.15)
    assert x.noise.coefficients[0] == pytest.approx(0.8, abs=0.1)


def delayed(time, values):
    """Stamps that run 2 % of a second late by the end."""
    return np.interp(time - 0.02 * time / time[-1], time, values)


@pytest.mark.parametrize(
    ("change", "words", "size"),
    [
        (lambda t, v: v + 3e-5 * (t > 0.1 + 5 * PERIOD), "an offset that jumps", 3e-5),
        (lambda t, v: v + 4e-5 * t / t[-1], "an offset that creeps", 4e-5 * 7 / 9),
        (delayed, "a lag that grows, as of a clock", 0.02 * 7 / 9),
    ],
    ids=("jump", "creep", "clock"),
)
def test_drift_is_told_by_its_shape(change, words, size):
    row = next(r for r in as_rows(proof(looped(change=change))) if r["channel"] == "x")
    assert row["drift"] == words
    assert row["drift_size"] == pytest.approx(size, rel=0.3)
    (notice,) = make_notices({"repeats": [row]}, Evidence())
    assert f"over 8 loops x shows {words}" in notice.text
    if "jumps" in words:
        assert row["jump_at"] == pytest.approx(0.1 + 5 * PERIOD, abs=0.02)


def test_a_mismatch_that_fades_is_a_warm_up():
    truth = with_effects(machine(), BACKLASH)
    plain, loose = looped(noise=0.0)["x"], looped(truth, noise=0.0)["x"]

    def fading(time, values):
        return values - (1 - np.exp(-time / 2.0)) * (loose - plain)

    row = next(r for r in as_rows(proof(looped(truth, change=fading))) if r["channel"] == "x")
    assert row["drift"] == "a mismatch that fades, as in a warm-up"


def noise_of(mismatch, motion=None):
    """The noise of x that errors of white noise and a mismatch (n,) of time are taken to have."""
    made = looped() if motion is None else record(machine(), motion, noise=NOISE)
    run = make_run(made, machine(), "train")
    time = run.excitation.time[run.samples[0].index]
    white_errors = NOISE * np.random.default_rng(4).normal(size=(2, len(time)))
    return own_models((run,), [[white_errors[0] + mismatch(time), white_errors[1]]])[0]


def in_every_loop(time):
    """A slow mismatch, three times the noise, that comes back in every loop."""
    return 3 * NOISE * np.sqrt(2) * np.sin(2 * np.pi * (time - time[0]) / PERIOD)


def test_what_comes_back_in_every_loop_colours_no_noise():
    x, y = noise_of(in_every_loop)
    assert x.marginal == pytest.approx(NOISE, rel=0.05)
    assert abs(x.coefficients.sum()) < 0.1
    assert y.marginal == pytest.approx(NOISE, rel=0.05)


def test_without_loops_it_does():
    x, _ = noise_of(in_every_loop, motion=rich_motion())
    assert x.marginal > 2 * NOISE
    assert x.coefficients.sum() > 0.5


def test_loops_that_drift_apart_tell_no_noise():
    """A mismatch that turns over from loop to loop: their differences hold twice of it."""

    def turning(time):
        loop = ((time - time[0]) / PERIOD).astype(int)
        return np.where(loop % 2 == 0, 1.0, -1.0) * in_every_loop(time)

    x, _ = noise_of(turning)
    own, differences = np.hypot(3, 1) * NOISE, np.hypot(3 * np.sqrt(2), 1) * NOISE
    assert x.marginal < 1.1 * own < differences
