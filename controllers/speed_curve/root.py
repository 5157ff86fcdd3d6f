"""Where a function is zero."""

from collections.abc import Callable
from typing import Any

from scipy.optimize import brentq


def root(function: Callable[[float], float], low: float, high: float, *, tolerance: float) -> float:
    """Return a root between two places where the function has different signs (Brent's method)."""
    found: Any = brentq(function, low, high, xtol=tolerance)
    return float(found)
