"""Effects that do nothing at all up to some size: fits begin where they begin to act."""

from dataclasses import replace

import numpy as np
import pytest
from engine_kit import machine, other_motion, problem, record, with_effects

from corexy_fmi.effects import catalogue
from corexy_fmi.engine.fitting.fit import minimise
from corexy_fmi.engine.fitting.retune import retune
from corexy_fmi.engine.fitting.unknowns import Hypothesis
from corexy_fmi.engine.naming.abreast import alone
from corexy_fmi.engine.naming.screen import screen
from corexy_fmi.engine.naming.signature import ACTS, changes, row_of, within_threshold
from corexy_fmi.kernel.layout import bundled_layout
from corexy_fmi.machine import EffectUse

SHARP = [e for e in catalogue().values() if e.size.over == "threshold"]
DRIVES = {"belt_slack": "yin2018", "supply_saturation": "yin2018_dc"}
EACH = pytest.mark.parametrize("effect", SHARP, ids=[e.name for e in SHARP])


def use(effect, size):
    return EffectUse(effect.name, next(iter(effect.locations)), {effect.size.name: size})


def edge(effect, low=1e-3, high=1e3):
    """The size beyond which a noiseless recording is that of the bare machine, by bisection."""
    bare = machine(DRIVES[effect.name])
    still = record(bare, other_motion(), noise=0.0)["x"]
    while high / low > 1.001:
        middle = np.sqrt(low * high)
        shown = record(with_effects(bare, use(effect, middle)), other_motion(), noise=0.0)["x"]
        low, high = (low, middle) if np.array_equal(still, shown) else (middle, high)
    return low


@EACH
def test_starts_lie_where_the_effect_begins_to_act(effect):
    bare = machine(DRIVES[effect.name])
    base = retune(bundled_layout(), bare, problem(record(bare, other_motion()), bare).runs)
    instance = bundled_layout().find(effect.name, next(iter(effect.locations)))
    chosen = replace(base.problem, hypothesis=Hypothesis((instance,)))
    u = chosen.carried(base.problem, base.u)
    sizes = alone(within_threshold(base, chosen, instance, u))
    others = {p.name: p.starts[0] for p in effect.parameters}
    rows = [row_of(chosen, u, instance, others | {effect.size.name: s}) for s in sizes]
    acts = np.abs(alone(changes(base, chosen, np.array(rows)))).max(axis=1) > ACTS
    assert acts[len(acts) // 2 :].all()  # the first are within a hair of it
    assert max(sizes) == pytest.approx(edge(effect), rel=0.1)
    assert min(sizes) < 0.3 * edge(effect)


@pytest.mark.parametrize("share", [0.75, 0.9])
@EACH
def test_a_little_of_it_is_found(effect, share):
    """On a known machine; between starts a factor of two apart it would be missed.

    How sharp its edge is, is fitted too, and noise moves both together.
    """
    bare = machine(DRIVES[effect.name])
    bare = replace(bare, rel_std=dict.fromkeys(bare.rel_std, 0.0))
    truth = share * edge(effect)
    shown = record(with_effects(bare, use(effect, truth)), other_motion(), noise=5e-6)
    base = retune(bundled_layout(), bare, problem(shown, bare).runs)
    instance = bundled_layout().find(effect.name, next(iter(effect.locations)))
    lead = screen(base, [Hypothesis((instance,))])[0]
    best = min((minimise(lead.problem, u, 8) for u in lead.starts), key=lambda fit: fit.cost)
    at = lead.problem.keys.index(_key(effect))
    assert float(lead.problem.unknowns[at].value(best.u[at])) == pytest.approx(truth, rel=0.04)


def _key(effect):
    return f"{effect.name}.{next(iter(effect.locations))}.{effect.size.name}"
