"""The fuzzy adaptive PID's three inferences, computed off line and looked up."""

from functools import lru_cache
from itertools import product
from typing import Any

from ..base.errors import BuildError
from ..base.ops import is_symbol
from .fuzzy_pid_rules import END, gain_rules

COUNT = 121  # points of each axis (ours): 0.1 apart, so that all peaks of sets are among them
Cells = tuple[tuple[tuple[float, float, float], ...], ...]


@lru_cache
def gain_table(extreme: float) -> Cells:
    """Return (ΔKp, ΔKi, ΔKd) on ±6 by row (e) and column (ec), from the exact inference.

    One half is inferred. The other is its negative, as all three rule bases are odd.
    """
    rules, half = gain_rules(extreme), COUNT // 2
    axis = [END / half * (k - half) for k in range(COUNT)]
    points = list(product(axis, axis))[: COUNT**2 // 2 + 1]
    cells = [(rules[0](*point), rules[1](*point), rules[2](*point)) for point in points]
    cells += [(-kp, -ki, -kd) for kp, ki, kd in reversed(cells[:-1])]
    return tuple(tuple(cells[k : k + COUNT]) for k in range(0, COUNT**2, COUNT))


def looked_up(cells: Cells, e: Any, ec: Any) -> tuple[float, float, float]:
    """Return the three by bilinear interpolation, for e and ec on ±6 (clipped before).

    Raise BuildError for symbols: they index no table, and an expression of all cells is C that
    takes minutes to compile and then is slower than the inference itself.
    """
    if is_symbol(e) or is_symbol(ec):
        raise BuildError("FuzzyPID: inference='table' is for floats; trace it with 'exact'")
    scale = (len(cells) - 1) / (2.0 * END)
    row, column = (e + END) * scale, (ec + END) * scale
    i, j = min(int(row), len(cells) - 2), min(int(column), len(cells) - 2)
    a, b = row - i, column - j
    upper, lower = cells[i], cells[i + 1]
    p, q, r, s = (1.0 - a) * (1.0 - b), (1.0 - a) * b, a * (1.0 - b), a * b
    corners = zip(upper[j], upper[j + 1], lower[j], lower[j + 1], strict=True)
    kp, ki, kd = [p * k + q * m + r * n + s * o for k, m, n, o in corners]
    return kp, ki, kd
