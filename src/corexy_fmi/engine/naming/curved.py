"""The competition, held once more on curved commands where only a cause at hand shows them."""

from __future__ import annotations

from collections.abc import Callable

from corexy_fmi.engine.fitting.between_rows import led
from corexy_fmi.engine.fitting.fit import Fit, Mapper
from corexy_fmi.engine.naming.entries import Competition
from corexy_fmi.engine.naming.name import compete
from corexy_fmi.engine.naming.search import rank

ASKED = 8  # entries, best first


def compete_on_curves(
    base: Fit, mapper: Mapper, tell: Callable[[str], None], without: frozenset[str]
) -> Competition:
    """All hypotheses' competition on the retuned machine; what is far above the noise hides what a
    log leaves out between its rows, and something else then makes up for it.
    """
    found = compete(led(base, base, mapper), mapper, tell, without)
    for entry in found.entries[:ASKED]:
        again = led(found.retuned, entry.fit, mapper)
        if again is not found.retuned:
            return min(found, compete(again, mapper, tell, without), key=_left)
    return found


def _left(competition: Competition) -> float:
    """What the best explanation leaves [nats]."""
    first = competition.best
    return rank(first.fit) if first else competition.retuned.cost
