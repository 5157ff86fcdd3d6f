"""Equations of one vehicle or coupler, applied to all of them: loops in C, at any length."""

from collections.abc import Callable, Hashable, Sequence
from functools import reduce
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

    Slopes that rise and then fall, as those of a brake's service curve, make it the maximum of the
    first lines and the minimum of the others, which is less work than a sum of ramps.
    """
    corners = _corners(points)
    if not corners:
        return points[0][1]
    pieces = [(a, f, (g - f) / (b - a)) for (a, f), (b, g) in pairwise(corners)]
    slopes = [slope for _, _, slope in pieces]
    steepest = slopes.index(max(slopes))
    first, (last, end) = corners[0][0], corners[-1]
    turns = slopes == [*sorted(slopes[:steepest]), *sorted(slopes[steepest:], reverse=True)]
    if not turns or any(f + slope * (last - a) > end for a, f, slope in pieces[:steepest]):
        return _sum_of_ramps(x, corners)
    within = ca.fmin(last, ca.fmax(first, x))  # in this order, so that no number stays none
    within = within - first if first else within
    lines = [_line(f - slope * (a - first), slope, within) for a, f, slope in pieces]
    return reduce(ca.fmax, lines[:steepest], reduce(ca.fmin, lines[steepest:]))


def _line(value: float, slope: float, x: Any) -> Any:
    return value + slope * x if value else slope * x


def _corners(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the points where the slope changes; beyond the ends it is zero."""
    slopes = [0.0, *((g - f) / (b - a) for (a, f), (b, g) in pairwise(points)), 0.0]
    least = 1e-12 * max(abs(slope) for slope in slopes)
    return [
        point
        for point, (before, after) in zip(points, pairwise(slopes), strict=True)
        if abs(after - before) > least
    ]


def _sum_of_ramps(x: Any, corners: Sequence[tuple[float, float]]) -> Any:
    """Return the same for any slopes: a ramp (x − a + |x − a|)/2 at each corner."""
    slopes = [0.0, *((g - f) / (b - a) for (a, f), (b, g) in pairwise(corners)), 0.0]
    value = corners[0][1]
    for (a, _), (before, after) in zip(corners, pairwise(slopes), strict=True):
        value = value + 0.5 * (after - before) * (x - a + ca.fabs(x - a))
    return value
