"""From a Python law to C: the function is run once on SymPy symbols and printed by SymPy."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection, Mapping
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


def _dear(expression: Any) -> bool:
    """Whether a number takes more than sums and products."""
    return any(
        e.is_Function or (e.is_Pow and not (e.exp.is_Integer and e.exp > 0))
        for e in sympy.preorder_traversal(expression)
    )


def hoisted(
    results: Mapping[str, Any], fixed: Collection[str], prefix: str
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Results with the dear parts that ``fixed`` names alone decide as symbols, ``prefix`` and a
    number, and those parts by symbol.
    """
    parts: dict[Any, sympy.Symbol] = {}

    def is_fixed(expression: Any) -> bool:
        return {str(symbol) for symbol in expression.free_symbols} <= set(fixed)

    def walk(expression: Any) -> Any:
        if isinstance(expression, sympy.Piecewise):
            return sympy.Piecewise(*((walk(e), condition) for e, condition in expression.args))
        if not isinstance(expression, sympy.Expr) or not _dear(expression):
            return expression
        if is_fixed(expression):
            name = sympy.Symbol(f"{prefix}{len(parts)}", real=True)
            return parts.setdefault(expression, name)
        if not (expression.is_Add or expression.is_Mul):
            return expression.func(*map(walk, expression.args))
        own = expression.func(*(a for a in expression.args if is_fixed(a)))
        return expression.func(walk(own), *(walk(a) for a in expression.args if not is_fixed(a)))

    found = {name: walk(sympy.sympify(e)) for name, e in results.items()}
    return found, {str(symbol): e for e, symbol in parts.items()}


def c_statements(results: Mapping[str, Any]) -> tuple[list[str], dict[str, str]]:
    """Common subexpressions as C statements, and one C expression for each result."""
    names = list(results)
    temporaries = sympy.numbered_symbols("t_", real=True)
    shared, reduced = sympy.cse([sympy.sympify(results[n]) for n in names], symbols=temporaries)
    lines = [f"const double {symbol} = {c_expression(value)};" for symbol, value in shared]
    return lines, {n: c_expression(e) for n, e in zip(names, reduced, strict=True)}
