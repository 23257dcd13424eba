"""Scalar functions that an effect's law may use: on floats, NumPy arrays and SymPy symbols."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy

Scalar = Any  # float, (n,) array or sympy.Expr

# of stage_math.h; SymPy's own Max and Min compare their arguments, which symbols refuse
LARGER = sympy.Function("larger", real=True)
SMALLER = sympy.Function("smaller", real=True)


def _symbolic(*values: Scalar) -> bool:
    return any(isinstance(v, sympy.Basic) for v in values)


def sin(x: Scalar) -> Scalar:
    """Sine of an angle [rad]."""
    return sympy.sin(x) if _symbolic(x) else np.sin(x)


def cos(x: Scalar) -> Scalar:
    """Cosine of an angle [rad]."""
    return sympy.cos(x) if _symbolic(x) else np.cos(x)


def exp(x: Scalar) -> Scalar:
    """Exponential of a dimensionless number."""
    return sympy.exp(x) if _symbolic(x) else np.exp(x)


def sqrt(x: Scalar) -> Scalar:
    """Square root."""
    return sympy.sqrt(x) if _symbolic(x) else np.sqrt(x)


def floor(x: Scalar) -> Scalar:
    """The largest whole number that is not above x."""
    return sympy.floor(x) if _symbolic(x) else np.floor(x)


def absolute(x: Scalar) -> Scalar:
    """Absolute value."""
    return sympy.Abs(x) if _symbolic(x) else np.abs(x)


def maximum(a: Scalar, b: Scalar) -> Scalar:
    """The larger of two values."""
    return LARGER(a, b) if _symbolic(a, b) else np.maximum(a, b)


def minimum(a: Scalar, b: Scalar) -> Scalar:
    """The smaller of two values."""
    return SMALLER(a, b) if _symbolic(a, b) else np.minimum(a, b)


def clamp(x: Scalar, lower: Scalar, upper: Scalar) -> Scalar:
    """The value of [lower, upper] that is nearest to x."""
    return maximum(lower, minimum(x, upper))


def select(condition: Scalar, if_true: Scalar, if_false: Scalar) -> Scalar:
    """``if_true`` where the condition holds, else ``if_false``."""
    if _symbolic(condition):
        return sympy.Piecewise((if_true, condition), (if_false, True))
    return np.where(condition, if_true, if_false)
