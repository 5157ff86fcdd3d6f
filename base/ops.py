"""Operations that mean the same on floats and on CasADi symbols.

A controller written with these runs as plain Python and can be traced into C. CasADi is
imported only when a symbol turns up: asking a symbol for its truth value raises RuntimeError.

On NaN the two differ: C's fmin and fmax drop a NaN, the Python forms may keep it. The master
refuses NaN before it matters.
"""

import math
from typing import Any


def _casadi() -> Any:
    import casadi

    return casadi


def is_symbol(a: Any) -> bool:
    """Return whether `a` is a CasADi expression rather than a number."""
    return type(a).__module__.startswith("casadi")


def minimum(a: Any, b: Any) -> Any:
    """Return the smaller of two values."""
    try:
        return a if a < b else b
    except RuntimeError:
        return _casadi().fmin(a, b)


def maximum(a: Any, b: Any) -> Any:
    """Return the larger of two values."""
    try:
        return a if a > b else b
    except RuntimeError:
        return _casadi().fmax(a, b)


def clip(a: Any, low: Any, high: Any) -> Any:
    """Return `a` limited to [low, high]."""
    try:
        return low if a < low else high if a > high else a
    except RuntimeError:
        return _casadi().fmin(_casadi().fmax(a, low), high)


def where(condition: Any, a: Any, b: Any) -> Any:
    """Return `a` where the condition holds, else `b`; both are evaluated."""
    try:
        return a if condition else b
    except RuntimeError:
        return _casadi().if_else(condition, a, b)


def absolute(a: Any) -> Any:
    """Return |a|."""
    return _casadi().fabs(a) if is_symbol(a) else math.fabs(a)


def finite(a: Any) -> bool:
    """Return whether `a` is a finite number; symbols pass."""
    return is_symbol(a) or (isinstance(a, int | float) and math.isfinite(a))
