"""Starts that are kept: the best ones, none beside a better one."""

import numpy as np

from corexy_fmi.engine.naming.screen import BESIDE, KEPT, apart


def test_the_best_are_kept_but_for_those_beside_them():
    starts = np.array([[0.0, 1.0], [0.9 * BESIDE, 1.0], [0.0, 2.0], [5.0, 1.0], [5.0, 1.1]])
    gains = np.array([3.0, 4.0, 1.0, 2.0, 2.5])
    assert apart(starts, gains) == [1, 4, 2]


def test_no_more_than_a_lead_offers():
    far = np.arange(10.0)[:, None]
    assert apart(far, -far[:, 0]) == list(range(KEPT))
