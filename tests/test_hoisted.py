"""What parameters alone decide is taken out of a law, and nothing else changes."""

import pytest
import sympy

from corexy_fmi.kernel.trace import hoisted, symbols
from corexy_fmi.kernel.xmath import exp, select

X, Y, P, Q = symbols(["x", "y", "p", "q"]).values()
FIXED = {"p", "q"}
CASES = {
    "a factor": (X * exp(-P / Q), 1),
    "a term beside others": (X + Y * X - sympy.cos(P), 1),
    "twice the same": (X * exp(P) + Y * exp(P), 1),
    "in a choice": (select(X > P, X / Q, Y), 1),
    "in a function of both": (exp(X - 1 / P), 1),
    "nothing dear": (X * P * Q + P**2, 0),
    "of the motion": (X / Y + exp(X), 0),
}


@pytest.mark.parametrize("case", CASES)
def test_the_parts_put_back_give_the_law(case):
    law, count = CASES[case]
    found, parts = hoisted({"force": law}, FIXED, "h_")
    assert len(parts) == count
    assert all({str(s) for s in part.free_symbols} <= FIXED for part in parts.values())
    again = found["force"].subs({sympy.Symbol(n, real=True): e for n, e in parts.items()})
    at = {X: 0.3, Y: -1.2, P: 0.7, Q: 1.9}
    assert float(again.subs(at)) == pytest.approx(float(law.subs(at)), rel=1e-12)


def test_nothing_is_taken_out_where_nothing_is_fixed():
    law = X * exp(-P / Q)
    assert hoisted({"force": law}, set(), "h_") == ({"force": law}, {})
