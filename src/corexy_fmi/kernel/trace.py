"""From a Python law to C: the function is run once on SymPy symbols and printed by SymPy."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

import sympy
from sympy.codegen.rewriting import create_expand_pow_optimization
from sympy.printing.c import C99CodePrinter

# of stage_math.h, which the compiler vectorises
FUNCTIONS = {"exp": "exponential", "sin": "sine", "cos": "cosine"}
FUNCTIONS |= {"larger": "larger", "smaller": "smaller"}
_expand_powers = create_expand_pow_optimization(8)


class _Printer(C99CodePrinter):
    """C without `pow`: SymPy makes one power of nested roots, which are printed as roots again."""

    def _print_Pow(self, expr: Any) -> str:  # noqa: N802, SymPy's name
        base, exponent = expr.as_base_exp()
        roots = {sympy.Rational(1, 2**n): n for n in (2, 3)}.get(abs(exponent))
        if roots is None:
            return str(super()._print_Pow(expr))
        inner = "sqrt(" * roots + self._print(base) + ")" * roots
        return f"1.0/{inner}" if exponent < 0 else inner


def argument_names(function: Callable[..., Any]) -> list[str]:
    """Names of a law's arguments, in order."""
    return list(inspect.signature(function).parameters)


def symbols(names: list[str]) -> dict[str, sympy.Symbol]:
    """Real symbols by name."""
    return {name: sympy.Symbol(name, real=True) for name in names}


def c_expression(expression: Any) -> str:
    """One expression as C."""
    return str(
        _Printer({"user_functions": FUNCTIONS}).doprint(_expand_powers(sympy.sympify(expression)))
    )


def c_statements(results: Mapping[str, Any]) -> tuple[list[str], dict[str, str]]:
    """Common subexpressions as C statements, and one C expression for each result."""
    names = list(results)
    temporaries = sympy.numbered_symbols("t_", real=True)
    shared, reduced = sympy.cse([sympy.sympify(results[n]) for n in names], symbols=temporaries)
    lines = [f"const double {symbol} = {c_expression(value)};" for symbol, value in shared]
    return lines, {n: c_expression(e) for n, e in zip(names, reduced, strict=True)}
