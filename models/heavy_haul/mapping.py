"""Equations of one vehicle or coupler, applied to all of them: loops in C, at any length."""

from collections.abc import Callable, Hashable, Sequence
from itertools import pairwise
from typing import Any, TypeVar

import casadi as ca

CHAINS = 8  # partial results of a sum; one chain of additions would wait for each of them
_Kind = TypeVar("_Kind", bound=Hashable)
Equations = Callable[..., Sequence[Any]]


def mapped(name: str, equations: Equations, *columns: Any, count: int) -> list[Any]:
    """Return the results of `equations`, each a column of `count`, for each row of the columns.

    `equations` takes as many scalar symbols and returns expressions. A column of one row stands for
    all rows.
    """
    symbols = [ca.SX.sym(f"a{i}") for i in range(len(columns))]
    function = ca.Function(name, symbols, list(equations(*symbols)))
    found = function.map(count).call([_row(column, count) for column in columns])
    return [row.T for row in found]


def mapped_by_kind(
    name: str,
    equations: Callable[[_Kind], Equations],
    kinds: Sequence[_Kind],
    *columns: Any,
) -> list[Any]:
    """Do the same where row i has the equations of `kinds[i]`."""
    different = list(dict.fromkeys(kinds))
    if len(different) == 1:
        return mapped(name, equations(different[0]), *columns, count=len(kinds))
    order: list[int] = []
    parts: list[list[Any]] = []
    for number, kind in enumerate(different):
        rows = [i for i, other in enumerate(kinds) if other == kind]
        own = [c if ca.MX(c).is_scalar() else ca.MX(c)[rows, 0] for c in columns]
        parts.append(mapped(f"{name}{number}", equations(kind), *own, count=len(rows)))
        order += rows
    back = [order.index(i) for i in range(len(kinds))]
    return [ca.vertcat(*part)[back, 0] for part in zip(*parts, strict=True)]


def total(column: Any) -> Any:
    """Return the sum of a column, in several chains of additions side by side."""
    return _folded(column, ca.sum1, lambda a, b: a + b)


def greatest(column: Any) -> Any:
    """Return the largest element of a column."""
    return _folded(column, ca.mmax, ca.fmax)


def _folded(column: Any, fold: Callable[[Any], Any], join: Callable[[Any, Any], Any]) -> Any:
    value = ca.MX(column)
    part = value.shape[0] // CHAINS
    if part < 2:
        return fold(value)
    chains = value[:part]
    for first in range(part, CHAINS * part, part):
        chains = join(chains, value[first : first + part])
    rest = value[CHAINS * part :]
    return join(fold(chains), fold(rest)) if rest.shape[0] else fold(chains)


def _row(column: Any, count: int) -> ca.MX:
    value = ca.MX(column)
    return ca.repmat(value, 1, count) if value.is_scalar() else value.T


def ramps(x: Any, points: Sequence[tuple[float, float]]) -> Any:
    """Return the piecewise linear function through the points; beyond the ends it stays level.

    A ramp is (x − a + |x − a|)/2: of a maximum with zero compilers make a branch.
    """
    slopes = [0.0, *((g - f) / (b - a) for (a, f), (b, g) in pairwise(points)), 0.0]
    steepest = max(abs(slope) for slope in slopes)
    value = points[0][1]
    for (a, _), (before, after) in zip(points, pairwise(slopes), strict=True):
        if abs(after - before) > 1e-12 * steepest:  # else the points lie on one line
            value = value + 0.5 * (after - before) * (x - a + ca.fabs(x - a))
    return value
