"""From a Python law to C: the function is run once on SymPy symbols and printed by SymPy."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

import sympy
from sympy.codegen.rewriting import create_expand_pow_optimization
from sympy.printing.c import C99CodePrinter

FUNCTIONS = {"exp": "exponential", "sin": "sine", "cos": "cosine"}  # stage_math.h
_expand_powers = create_expand_pow_optimization(4)


class _Printer(C99CodePrinter):
    """SymPy's own printer, with the functions of stage_math.h, which the compiler vectorises."""

    def _print_Max(self, expr: Any) -> str:  # noqa: N802  (SymPy's naming)
        return self._chain("larger", expr.args)

    def _print_Min(self, expr: Any) -> str:  # noqa: N802
        return self._chain("smaller", expr.args)

    def _chain(self, name: str, args: tuple[Any, ...]) -> str:
        text = self._print(args[0])
        for other in args[1:]:
            text = f"{name}({text}, {self._print(other)})"
        return text


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
