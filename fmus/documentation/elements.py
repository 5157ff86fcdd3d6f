"""A column of expressions, as few as say what all elements are: "for i = 2, …, n − 1"."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca

from .sharing import without_shared
from .template import FARTHEST, Leaf, Template

_ALL = 6  # up to this size every element may have its own row
_MOST = 4  # rows shown of a larger column


@dataclass(frozen=True)
class Progression:
    """A number that is the element's own: `start` + `step` · i for element i (from 0), whole."""

    start: float
    step: float


@dataclass(frozen=True)
class Row:
    """An expression that holds for elements `indices` (from 0).

    It is that of element `base`. For element i the leaves in `moving` are i − base further on.
    `shared` says what symbols stand for that are no leaves; in there nothing moves.
    """

    indices: tuple[int, ...]
    expression: ca.SX
    base: int = 0
    moving: frozenset[Leaf] = frozenset()
    shared: Mapping[str, ca.SX | Progression] = field(default_factory=dict)


def rows(column: ca.SX, inputs: Sequence[ca.SX]) -> tuple[list[Row], int]:
    """Return what to show of a column, and how many of its elements that leaves out.

    A row for several elements holds for each of them exactly: CasADi compares the expressions.
    """
    return picked(column.numel(), lambda base, rest: _row(column, inputs, base, rest))


def picked(size: int, row_of: Callable[[int, dict[int, None]], Row]) -> tuple[list[Row], int]:
    """Return rows for a column's elements, and how many of these are in none.

    `row_of` gives the row of one element and of those of the rest that are like it.
    """
    rest = dict.fromkeys(range(size))
    found: list[Row] = []
    picks = 0
    most = _ALL if size <= _ALL else _MOST
    while rest and len(found) < most:
        left = list(rest)
        base = left[(len(left) // 2, 0, -1)[picks % 3]]
        row = row_of(base, rest)
        picks += 1
        if picks == 1 and len(row.indices) == 1 < len(left):
            continue  # the middle one is like no other: begin with the first
        found.append(row)
        for i in row.indices:
            del rest[i]
    return sorted(found, key=lambda row: row.indices[0]), len(rest)


def _row(column: ca.SX, inputs: Sequence[ca.SX], base: int, rest: dict[int, None]) -> Row:
    """Return a row for many elements of the rest, the base among them, or for that alone."""
    for expression, shared in _variants(column, base) if len(rest) > 1 else ():
        template = Template(expression, base, shared)
        if template.is_too_large(len(rest)):
            continue
        for reach in (FARTHEST, 0):
            moving = template.moving(inputs, reach)
            followers = template.followers(column, inputs, moving)
            indices = tuple(i for i in followers if i in rest)
            if len(indices) > 1:
                return Row(indices, expression, base, moving, shared)
    return Row((base,), column[base])


def _variants(column: ca.SX, base: int) -> Iterator[tuple[ca.SX, dict[str, ca.SX]]]:
    """Yield the base's expression, as it is and with symbols for what it shares with others."""
    yield column[base], {}
    far = (base + column.numel() // 2) % column.numel()
    expression, shared = without_shared(column[base], column[far])
    if shared:
        yield expression, shared
