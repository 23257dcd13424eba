"""Which tones a fit's residuals offer, and how their frequency is narrowed down."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import fitted, machine, problem, record, rich_motion, with_effects

from corexy_fmi.engine.naming import by_run
from corexy_fmi.engine.naming.abreast import in_companies
from corexy_fmi.engine.naming.beyond import beyond
from corexy_fmi.engine.naming.spread import spread
from corexy_fmi.engine.naming.tones import LOCAL, TONES, _around, _chosen, _mean, _peaks, _spectrum
from corexy_fmi.machine import EffectUse

AT = ("periodic_disturbance", "y")
FREQUENCY, LENGTH = 23.0, 5.7  # [Hz, s]
TONE = {"amplitude": 0.5, "frequency": FREQUENCY, "phase": 0.4}


@pytest.fixture(scope="module")
def base():
    """What retuning makes of a tone at y."""
    recording = record(with_effects(machine(), EffectUse(*AT, TONE)), rich_motion())
    return fitted(problem(recording, machine()))


def best(base, frequency):
    """The best score where the spectrum shows nothing but this frequency."""
    instance = base.problem.layout.find(*AT)
    asked = replace(base.problem, hypothesis=replace(base.problem.hypothesis, uses=(instance,)))
    u = asked.carried(base.problem, base.u)
    offered = replace(spread(base), frequency=(frequency,))

    def steps(one):
        return (yield from by_run.by_run(beyond(base), one, instance, u, offered))

    return in_companies(steps, [asked], map)[0][0]


def in_slow_noise(amplitude):
    """A tone of 29.2 Hz in noise that is alike over 5 ms, 20 s at 100 Hz: what is offered."""
    white, slow = np.random.default_rng(5).standard_normal(2000), np.zeros(2000)
    for n in range(1, 2000):
        slow[n] = 0.84 * slow[n - 1] + white[n]
    tone = amplitude * np.sin(2 * np.pi * 29.2 * 0.01 * np.arange(2000))
    f, power = _spectrum(slow + tone - np.mean(slow + tone), 0.01)
    strongest = _chosen([_peaks(power / _mean(power), f)], TONES)
    return strongest, _chosen([_peaks(power / _around(power), f)], LOCAL, strongest)


def test_a_tone_that_slow_noise_outshines_is_offered():
    """None of the strongest, for slow noise is as strong as it nearly everywhere below."""
    strongest, local = in_slow_noise(0.25)
    assert all(abs(f - 29.2) > 0.2 for f in strongest)
    assert local[0] == pytest.approx(29.2, abs=0.05)
    assert all(abs(f - 29.2) > 0.2 for f in in_slow_noise(0.0)[1])


@pytest.mark.parametrize("off", [-0.7, 0.8])
def test_a_tone_beside_its_peak_is_found(base, off):
    """Off by so many waves over the run: narrowed down to a quarter of a wave."""
    known, found = best(base, FREQUENCY), best(base, FREQUENCY + off / LENGTH)
    assert abs(found.values["frequency"] - FREQUENCY) < 0.26 / LENGTH
    assert found.gain > 0.8 * known.gain


def test_nothing_is_narrowed_down_where_nothing_is_heard(base, monkeypatch):
    monkeypatch.setattr(by_run, "HEARD", 1e9)
    assert best(base, FREQUENCY + 0.1).values["frequency"] == FREQUENCY + 0.1


def test_frequencies_beside_one_cover_its_peak(base):
    """`WIDE` waves of the shortest run either way, `APART` of the longest, at most `MOST`."""
    near = np.array(by_run._beside(base.problem, FREQUENCY))
    assert len(near) == 2 * by_run.WIDE / by_run.APART
    length = float(np.ptp(base.problem.runs[0].excitation.time))
    assert np.ptp(near) == pytest.approx(2 * by_run.WIDE / length)
    assert min(by_run._beside(base.problem, 0.1)) > 0
