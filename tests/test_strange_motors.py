"""Dc motors drawn for stages, the poles of their loops, what a driver makes of volts."""

import numpy as np
from strange_kit import turned

from benchmarks.strange import loop, motors

SEEDS = range(40)


def test_motors_suit_their_stages():
    for seed in SEEDS:
        machine, sensor = turned(seed)
        n = machine.numbers
        for name, (low, high) in zip(
            ("J", "K1", "K2"), (motors.INERTIA, motors.GAIN, motors.DAMPING), strict=True
        ):
            assert low <= n[name] <= high
        found, share = motors.poles(n)
        assert (found.real < 0).all()
        assert (-found.real / np.abs(found))[share > 0.5].min() > 0.1
        a, b, gains = motors.sampled(n, sensor.row)
        assert np.abs(np.linalg.eigvals(a - b @ gains)).max() < 1
        assert 4.99e-4 <= sensor.row <= 1.001e-3
        assert 99 <= 1 / (sensor.row * sensor.every) <= 1001


def test_a_bridge_gives_what_it_can():
    given = [loop._bridge(v, loop.Drive(dead=0.5, limit=2.0)) for v in (-9.0, -0.4, 0.3, 1.5)]
    assert given == [-2.0, 0.0, 0.0, 1.0]
    assert loop._bridge(-0.7, loop.Drive(dead=0.5, lost=0.0)) == -0.7
