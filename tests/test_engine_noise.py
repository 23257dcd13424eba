"""Noise models, samples, the split in time, and spikes."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import (
    ASIDE,
    NOISE,
    fitted,
    machine,
    pair,
    problem,
    record,
    rich_motion,
    short_motion,
    with_effects,
)
from scipy.signal import lfilter

from corexy_fmi.engine import diagnose
from corexy_fmi.engine.data.samples import Samples, make_run, split_in_time
from corexy_fmi.engine.data.steps import least_step
from corexy_fmi.engine.fitting.clean import STARK, spikes, told, without_spikes
from corexy_fmi.engine.fitting.noise import (
    Noise,
    estimate,
    finest,
    quick_noise,
    warm_up,
)
from corexy_fmi.engine.fitting.quiet import own_models

COUNT = 6000
MODELS = {
    "white": ((), 1.0),
    "half": ((0.5,), 1.0),
    "slow": ((0.95,), 0.3),
    "ringing": ((1.6, -0.8), 0.2),
}


def coloured(coefficients, innovation, count=COUNT, seed=3):
    white = innovation * np.random.default_rng(seed).normal(size=count + 500)
    return lfilter([1.0], np.r_[1.0, -np.array(coefficients)], white)[500:]


def unbroken(count=COUNT):
    return np.arange(count) == 0


@pytest.mark.parametrize(("coefficients", "innovation"), MODELS.values(), ids=MODELS)
def test_coefficients_are_recovered(coefficients, innovation):
    noise = estimate(coloured(coefficients, innovation), unbroken())
    found = np.zeros(8)
    found[: len(noise.coefficients)] = noise.coefficients
    assert found[: len(coefficients)] == pytest.approx(coefficients, abs=0.06)
    assert np.abs(found[len(coefficients) :]).max(initial=0) < 0.06
    assert noise.innovation == pytest.approx(innovation, rel=0.05)


@pytest.mark.parametrize(("coefficients", "innovation"), MODELS.values(), ids=MODELS)
def test_whitened_errors_are_white_with_unit_variance(coefficients, innovation):
    noise = estimate(coloured(coefficients, innovation), unbroken())
    white = noise.whiten(coloured(coefficients, innovation, seed=4), unbroken())
    assert white.std() == pytest.approx(1.0, abs=0.05)
    lags = [np.corrcoef(white[k:], white[:-k])[0, 1] for k in range(1, 9)]
    assert np.abs(lags).max() < 4 / np.sqrt(COUNT)


def test_order_zero_is_chosen_for_white_noise():
    orders = [len(estimate(coloured((), 1.0, 2000, seed), unbroken(2000)).coefficients)
              for seed in range(20)]  # fmt: skip
    assert sum(order > 0 for order in orders) <= 2


def test_gaps_do_not_mislead_the_model():
    """Blocks of 12 samples out of a long sequence: the neighbours across a gap are strangers."""
    errors = coloured((0.95,), 0.3, 60000)
    kept = np.arange(60000) % 100 < 12
    breaks = np.r_[True, np.diff(np.flatnonzero(kept)) > 1]
    noise = estimate(errors[kept], breaks)
    assert noise.coefficients[0] == pytest.approx(0.95, abs=0.03)
    blind = estimate(errors[kept], unbroken(kept.sum()))
    assert blind.coefficients[0] < 0.9
    white = noise.whiten(errors[kept], breaks)
    assert white.std() == pytest.approx(1.0, abs=0.05)
    assert white[breaks] == pytest.approx(errors[kept][breaks] / noise.marginal)


def test_the_filter_starts_anew_after_a_break():
    breaks = np.zeros(12, dtype=bool)
    breaks[[0, 6]] = True
    assert np.flatnonzero(warm_up(breaks, 2)).tolist() == [0, 1, 6, 7]
    assert np.flatnonzero(warm_up(breaks, 0)).tolist() == []
    noise = Noise(np.array([0.9]), 1.0, 2.0)
    errors = np.random.default_rng(1).normal(size=12)
    other = errors.copy()
    other[:6] += 100.0
    assert noise.whiten(errors, breaks)[6:] == pytest.approx(noise.whiten(other, breaks)[6:])


def test_the_scale_is_the_gaussian_likelihoods():
    """0.5 |w|^2 + log scale is minus the log density, but for the constant."""
    noise, breaks = Noise(np.array([0.9]), 0.5, 0.5 / np.sqrt(1 - 0.81)), unbroken(50)
    errors = coloured((0.9,), 0.5, 50)
    covariance = noise.marginal**2 * 0.9 ** np.abs(np.subtract.outer(range(50), range(50)))
    exact = 0.5 * errors @ np.linalg.solve(covariance, errors)
    exact += 0.5 * np.linalg.slogdet(covariance)[1]
    white = noise.whiten(errors, breaks)
    assert 0.5 * white @ white + noise.log_scale(breaks) == pytest.approx(exact, abs=1e-9)


def test_errors_of_a_run_that_broke_down_stay_silent():
    noise = Noise(np.array([1.6, -0.8]), 1e-5, 1e-4)
    white = noise.whiten(np.full(100, 1e308), unbroken(100))
    assert not np.isfinite(white).all()


def test_quick_noise_sees_through_motion():
    recording = record(machine(), rich_motion(), noise=NOISE)
    (samples, _) = make_run(recording, machine(), "train").samples
    assert quick_noise(samples) == pytest.approx(NOISE, rel=0.05)


def test_quick_noise_of_a_coarse_sensor_is_its_rounding():
    recording = record(machine(), short_motion(), noise=0.0)
    coarse = 1e-3 * np.round(recording["x"] / 1e-3)
    samples = Samples.of("x", coarse, recording.time, np.ones(len(coarse), dtype=bool))
    assert quick_noise(samples) == pytest.approx(1e-3 / np.sqrt(12))


def test_a_recording_without_noise_has_a_ten_millionth_of_its_motion():
    recording = record(machine(), rich_motion(), noise=0.0)
    run = make_run(recording, machine(), "train")
    least = [1e-7 * np.std(recording[c]) for c in ("x", "y")]
    assert [finest(s) for s in run.samples] == pytest.approx(least)
    random = np.random.default_rng(1)
    for size, expected in ((1e-13, least), (1e-6, (1e-6, 1e-6))):
        errors = [size * random.normal(size=len(s.index)) for s in run.samples]
        found = own_models((run,), [errors])[0]
        assert [n.marginal for n in found] == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("size", [1e-3, 1.0, 30.0])
def test_smooth_errors_are_foretold_no_better_than_the_least_noise(size):
    """Else a smooth mismatch, every sample of which follows from those before, would be likelier
    than none at all: that was named in recordings without noise.
    """
    smooth = size * np.sin(np.arange(COUNT) / 200.0)
    noise, nothing = (estimate(e, unbroken(), 1.0) for e in (smooth, np.zeros(COUNT)))

    def surprise(noise, errors):
        return noise.log_scale(unbroken()) + 0.5 * np.sum(noise.whiten(errors, unbroken()) ** 2)

    assert noise.innovation >= nothing.innovation == 1.0
    assert surprise(noise, smooth) > surprise(nothing, np.zeros(COUNT))


@pytest.mark.long
def test_a_recording_without_noise_of_nothing_is_nothing():
    """Arithmetic that is left of it, 1e-12 m, was unexplained before."""
    chosen = machine("light_bench")
    files, judge = pair(with_effects(chosen, **ASIDE), noise=0.0)
    found = diagnose(files, judge, chosen, jobs=2).document
    assert found["verdict"] == "nothing_missing"
    assert found["heldout"]["rms_retuned"] < 1e-9


def test_samples_of_a_tracker():
    recording = record(machine(), short_motion(), tracker=10)
    run = make_run(recording, machine(), "train")
    assert [s.channel for s in run.samples] == ["x", "y"]
    assert run.outputs == ("x", "y")
    for samples in run.samples:
        assert samples.index.tolist() == list(range(0, len(recording), 10))
        assert np.flatnonzero(samples.breaks).tolist() == [0]
        assert np.array_equal(samples.value, recording[samples.channel][samples.index])
    assert run.count == 2 * len(run.samples[0].index)


def test_a_dropout_breaks_the_samples():
    values = np.arange(100.0)
    values[40:45] = np.nan
    samples = Samples.of("x", values, 1e-3 * np.arange(100), np.ones(100, dtype=bool))
    assert np.flatnonzero(samples.breaks).tolist() == [0, 40]
    assert len(samples.index) == 95
    drop = np.zeros(95, dtype=bool)
    drop[10] = True
    less = samples.without(drop)
    assert np.flatnonzero(less.breaks).tolist() == [0, 10, 39]


def test_channels_that_do_not_count():
    recording = record(machine(), short_motion(), channels=("x", "y", "phi1_meas"))
    few = np.full(len(recording), np.nan)
    few[:20] = 0.0
    recording = replace(recording, channels={**recording.channels, "y": few})
    assert [s.channel for s in make_run(recording, machine(), "train").samples] == ["x"]


def test_the_split_in_time():
    recording = record(machine(), rich_motion())
    early, late = split_in_time(recording, machine(), 0.35)
    time, end = recording.time, recording.time[-1]
    assert (early.role, late.role) == ("train", "holdout")
    assert time[early.samples[0].index[-1]] == pytest.approx(0.7 * end, abs=2e-3)
    assert time[late.samples[0].index[0]] == pytest.approx(0.7 * end + 0.35, abs=2e-3)
    assert time[late.samples[0].index[-1]] == end
    assert np.array_equal(late.excitation.time, time)


def test_a_short_recording_keeps_something_back():
    _, late = split_in_time(record(machine(), short_motion()), machine(), 5.0)
    assert len(late.samples[0].index) > 20


def clock(count):
    return 1e-3 * np.arange(count)


def test_spikes_are_seen():
    errors = coloured((0.9,), 0.1, 2000)
    bad = np.array([100, 500, 900, 1500])
    errors[bad] += np.array([20.0, -30.0, 25.0, 20.0])
    assert np.flatnonzero(spikes(errors, clock(2000))).tolist() == bad.tolist()


@pytest.mark.parametrize(("ripple", "seen"), [(0.0, 0.94), (1.0, 0.90)])
def test_of_spikes_in_white_noise_nearly_all_are_seen_and_nothing_else(ripple, seen):
    """Of 8 to 20 deviations at 100 Hz, rows missing, beside a ripple of 17 Hz as large as noise."""
    random, time = np.random.default_rng(4), 0.01 * np.arange(200_000)
    errors = random.normal(size=len(time)) + ripple * np.sqrt(2) * np.sin(2 * np.pi * 17.3 * time)
    bad = random.random(len(time)) < 0.002
    errors += bad * random.choice([-1.0, 1.0], len(time)) * random.uniform(8, 20, len(time))
    kept = random.random(len(time)) > 0.025
    found = spikes(errors[kept], time[kept])
    assert not (found & ~bad[kept]).any()
    assert (found & bad[kept]).sum() > seen * bad[kept].sum()


@pytest.mark.parametrize("at", [47, 48, 49, 50, 51, 52])
@pytest.mark.parametrize("gap", [0.6e-3, 2e-3, 0.1])
def test_spikes_are_seen_beside_a_gap(at, gap):
    errors = 0.1 * np.random.default_rng(2).normal(size=100)
    time = clock(100)
    time[50:] += gap
    assert not spikes(errors, time).any()
    errors[at] += 10.0
    assert np.flatnonzero(spikes(errors, time)).tolist() == [at]


def test_of_pairs_of_spikes_in_white_noise_most_are_seen_and_nothing_else():
    """Of 8 to 20 deviations, one sample apart; 27 % were while each was judged beside the other."""
    random, first = np.random.default_rng(4), np.arange(50, 200_000, 1000)
    errors = random.normal(size=200_000)
    bad = np.zeros(len(errors), dtype=bool)
    for at in (first, first + 2):
        errors[at] += random.choice([-1.0, 1.0], len(at)) * random.uniform(8, 20, len(at))
        bad[at] = True
    found = spikes(errors, 0.01 * np.arange(len(errors)))
    assert not (found & ~bad).any()
    assert (found & bad).sum() > 0.9 * bad.sum()


def found_in(count, change):
    """Spikes in so many rows of white noise that were changed, as lists of places."""
    for seed in range(count):
        errors = np.random.default_rng(seed).normal(size=100)
        yield np.flatnonzero(spikes(change(errors), clock(100))).tolist()


@pytest.mark.parametrize("at", [0, 1, 98, 99])
def test_a_spike_at_an_end_is_seen(at):
    """One of 14 deviations, last but one, was named as lost steps in the last milliseconds."""
    assert not any(found_in(200, lambda errors: errors))
    found = list(found_in(200, lambda errors: errors + 14.0 * (np.arange(100) == at)))
    assert all(some in ([], [at]) for some in found)
    assert sum(map(len, found)) > 0.9 * len(found)


@pytest.mark.parametrize("last", [2, 3, 50])
@pytest.mark.parametrize("size", [10.0, 20.0, 1000.0])
@pytest.mark.parametrize("way", [1, -1])
def test_a_step_near_an_end_is_none(last, size, way):
    """No more often than far from it."""
    step = (size * (np.arange(100) >= 100 - last))[::way]
    assert sum(map(bool, found_in(200, lambda errors: errors + step))) <= 0.05 * 200


@pytest.mark.parametrize("way", [1, -1])
def test_what_rings_at_an_end_is_no_spike(way):
    swing = np.exp(-np.arange(100)[::-1] / 20) * np.sin(0.5 * np.arange(100))
    for size in (5.0, 50.0, 1000.0):
        assert not any(found_in(50, lambda errors, size=size: errors + size * swing[::way]))


@pytest.mark.parametrize("second", [10.0, -10.0])
@pytest.mark.parametrize("apart", [1, 2, 3])
@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_a_spike_hides_no_spike_near_it(apart, second, gap):
    """Two side by side on one side of the course are a peak, which may be physics."""
    errors, time = 0.1 * np.random.default_rng(2).normal(size=400), clock(400)
    time[201:] += gap
    errors[200], errors[200 + apart] = 10.0, second
    pair = [] if apart == 1 and second > 0 else [200, 200 + apart]
    assert np.flatnonzero(spikes(errors, time)).tolist() == pair


@pytest.mark.parametrize(("size", "seen"), [(5.0, []), (20.0, [200, 201])])
def test_two_alike_far_enough_off_are_no_peak_of_a_place(size, seen):
    """2 mm for two samples, at 500 Hz, in noise of 20 um: 500 m/s^2 there and back."""
    errors = 0.1 * np.random.default_rng(2).normal(size=400)
    errors[200:202] += size
    assert np.flatnonzero(spikes(errors, clock(400), 0.0, STARK)).tolist() == seen


def test_counts_that_differ_in_their_last_bits_are_one_step():
    """Of an encoder at 4.6592e-3 m/s a count, sums of counts are no whole multiples in binary."""
    counts = np.array([0, 1, 0, 1, 3, 2, 1, -1, 0])
    values = 4.6592e-3 * counts
    values[3] = np.nextafter(values[3], 1)
    assert least_step(values) == pytest.approx(4.6592e-3)


def test_few_samples_or_silent_ones_have_no_spikes():
    assert not spikes(np.array([0.0, 0.0, 9.0, 0.1]), clock(4)).any()
    assert not spikes(np.zeros(100), clock(100)).any()


@pytest.mark.parametrize("gap", [0.0, 0.1])
@pytest.mark.parametrize("shape", ["step", "ramp", "peak of three samples"])
def test_physics_is_no_spike(shape, gap):
    errors = 0.1 * np.random.default_rng(2).normal(size=400)
    time = clock(400)
    time[200:] += gap
    if shape == "step":
        errors[200:] += 10.0
    elif shape == "ramp":
        errors += np.interp(np.arange(400), [190, 200, 210], [0.0, 20.0, 0.0])
    else:
        errors[199:202] += 10.0
    assert not spikes(errors, time).any()


def test_a_missing_row_parts_no_samples_that_come_in_time():
    time = 1e-3 * np.delete(np.arange(1000), [205, 733])
    values = np.where(np.rint(time / 1e-3) % 10 == 0, 1.0, np.nan)
    samples = Samples.of("x", values, time, np.ones(998, dtype=bool))
    assert set(np.diff(samples.index)) == {9, 10}
    assert np.flatnonzero(samples.breaks).tolist() == [0]
    lost = np.delete(np.arange(998), samples.index[40])
    samples = Samples.of("x", values[lost], time[lost], np.ones(997, dtype=bool))
    assert np.flatnonzero(samples.breaks).tolist() == [0, 40]


def test_stamps_that_scatter_part_no_samples():
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.uniform(0.2e-3, 1.8e-3, 500))
    samples = Samples.of("x", time, time, np.ones(500, dtype=bool))
    assert np.flatnonzero(samples.breaks).tolist() == [0]


def test_spikes_are_left_out_of_a_fit_and_nothing_else():
    recording = record(machine(), short_motion())
    x, bad = recording["x"].copy(), np.array([200, 400, 600, 800])
    x[bad] += 3e-3
    recording = replace(recording, channels={**recording.channels, "x": x})
    (run,) = without_spikes(fitted(problem(recording, machine()), 2))
    assert sorted(set(range(len(x))) - set(run.samples[0].index)) == bad.tolist()
    assert len(run.samples[1].index) == len(x)
    assert run.samples[0].breaks.sum() == 1 + len(bad)
    (found,) = told(problem(recording, machine()).runs, [run])
    assert f"4 of {len(x)} samples of x stand alone" in found.text


def test_many_spikes_are_no_spikes():
    recording = record(machine(), short_motion())
    x = recording["x"].copy()
    x[::20] += 3e-3
    recording = replace(recording, channels={**recording.channels, "x": x})
    (run,) = without_spikes(fitted(problem(recording, machine()), 2))
    assert len(run.samples[0].index) == len(x)
