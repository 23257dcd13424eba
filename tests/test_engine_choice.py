"""Linear responses of places, seen through a noise: which are taken, and what two at once do."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import NOISE, fitted, machine, problem, record, rich_motion

from corexy_fmi.engine.fitting.fit import own_noise, white_noise
from corexy_fmi.engine.places.choice import ROUNDS, choose, explain
from corexy_fmi.engine.places.offer import Offer
from corexy_fmi.engine.places.responses import Response
from corexy_fmi.engine.places.view import View, plain


def test_what_is_taken_pays_its_price():
    changes = np.eye(3, 100, dtype=np.float32)
    residual = 10 * changes[0] + 3 * changes[1] + changes[2]
    some = tuple(Response("x", "time", str(n), change) for n, change in enumerate(changes))
    offer = Offer((some,), (changes,), (np.zeros((3, 0)),))
    taken, gain, alone = choose(offer, residual, np.full(3, 2.0))
    assert (taken, gain) == ([0, 1], pytest.approx(50 + 4.5 - 4))
    assert alone == pytest.approx([50, 4.5, 0.5])
    assert choose(offer, residual, np.array([60.0, 2.0, 2.0]))[0] == [1]


def test_a_law_at_both_places_is_the_sum_of_both():
    fit, wave = shaken(NOISE)
    other = replace(wave, location="belt2", change=wave.change[::-1].copy())
    view = View(plain(fit), fit.problem.noise)
    one, two = (Offer.of([w], view) for w in (replace(wave, location="belt1"), other))
    tied = one.beside(two, "belts", (1.0, -1.0))
    formed = [tied.response(k) for k in range(len(tied))]
    assert [r.location for r in formed] == ["belt1", "belt2", "belts", "belts"]
    assert formed[3].change == pytest.approx(wave.change - wave.change[::-1])
    whole = Offer.of(formed, view)
    for told, share in ((Offer.row, 1e-4), (Offer.reach, 1e-5)):
        got, wanted = (np.array([told(o, k) for k in range(4)]) for o in (tied, whole))
        assert float(np.abs(got - wanted).max()) < share * float(np.abs(wanted).max())
    column = np.random.default_rng(0).standard_normal(len(whole.row(0)))
    for k, row in enumerate(map(whole.row, range(4))):
        assert tied.powers()[k] == pytest.approx(row @ row, rel=1e-4)
        assert tied.times(column)[k] == pytest.approx(
            row @ column, abs=1e-3 * float(np.sqrt(row @ row))
        )


def test_what_cancels_at_both_places_explains_nothing():
    """Products of a sum are told from those of its parts: of what is left there, rounding."""
    draw = np.random.default_rng(1)
    wave, residual = (1e3 * draw.standard_normal(20_000).astype(np.float32) for _ in range(2))
    alike = wave + np.float32(1e-6) * wave[::-1]
    offers = [
        Offer(((Response(place, "load", "pull", off),),), (off[None],), (np.zeros((1, 0)),))
        for place, off in (("belt1", wave), ("belt2", alike))
    ]
    both = offers[0].beside(offers[1], "belts", (1.0, -1.0))
    assert list(both.powers() > 0) == [True, True, True, False]
    assert choose(both, residual.astype(float), np.ones(4))[2][3] < 1e-3


def shaken(size):
    """A retuned machine whose x is off by a wave, and that wave as a response."""
    shown = record(machine(), rich_motion())
    time = shown.time
    wave = np.sin(2 * np.pi * 0.7 * time) * np.exp(-time / 2)
    x = shown.channels["x"] + size * wave
    fit = fitted(problem(replace(shown, channels=shown.channels | {"x": x}), machine()), 10)
    change = np.zeros(sum(run.count for run in fit.problem.runs))
    change[: len(wave)] = wave - wave.mean()
    return fit, Response("x", "time", "a wave", change.astype(np.float32))


def test_a_choice_is_judged_through_the_noise_that_it_leaves():
    """Retuned under its own noise, a slow wave is colour; by what it leaves it is found."""
    fit, wave = shaken(3 * NOISE)
    own = replace(fit, problem=own_noise(fit))
    bare = plain(own)
    coloured, least = (View(bare, n) for n in (own.problem.noise, white_noise(own).noise))
    alone = explain(Offer.of([wave], coloured), coloured, 5.0, coloured.cost, 0)
    told = explain(Offer.of([wave], least), least, 5.0, coloured.cost, ROUNDS)
    assert told.gain > alone.gain + 50
    assert told.taken == (wave,)


def test_what_the_data_chose_costs_its_choice():
    """A tone that was read off the mismatch is one of as many as there are samples."""
    fit, wave = shaken(3 * NOISE)
    view = View(plain(fit), white_noise(fit).noise)
    law, tone, one_of_all = (
        explain(Offer.of([replace(wave, chosen=chosen)], view), view, 5.0, view.cost, 0)
        for chosen in (0.0, 7.0, 1e6)
    )
    assert tone.gain == pytest.approx(law.gain - 7)
    assert one_of_all.taken == ()


def test_through_a_view_nothing_is_gained_by_what_is_not_there():
    fit, wave = shaken(0.0)
    for models in (fit.problem.noise, white_noise(fit).noise):
        view = View(plain(fit), models)
        assert explain(Offer.of([wave], view), view, 5.0, view.cost, ROUNDS).taken == ()


def test_a_view_leaves_what_another_fit_would():
    """Linear algebra against the fit itself: errors left by retuning and a change."""
    fit, wave = shaken(2 * NOISE)
    view = View(plain(fit), fit.problem.noise)
    off, along = view.off(wave.change[None])
    left = np.concatenate(view.left((wave.change[None], off, along))[0])
    columns = np.vstack([fit.jacobian.T, np.pad(wave.change, (0, fit.problem.size)) / NOISE]).T
    steps = np.linalg.lstsq(columns, fit.residual, rcond=None)[0]
    count = len(wave.change)
    assert left == pytest.approx((fit.residual - columns @ steps)[:count] * NOISE, abs=1e-8)
