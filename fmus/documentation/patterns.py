"""Which elements of a column follow one pattern: all are compared at once with one of them."""

from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..loops import SHIFT, Codes, Line, split
from .columns import Columns, arity, operands_of
from .elements import Progression, Row, picked
from .template import Leaf

_FEWEST = 5  # elements from which on numbers that grow evenly count as the element's own
Mask = NDArray[np.bool_]


def rows_of(columns: Columns, column: Codes) -> tuple[list[Row], int]:
    """Return what to show of a column, and how many of its elements that leaves out.

    A row for several elements holds for each of them exactly: every operation and every operand
    of each is compared.
    """

    def row(base: int, rest: dict[int, None]) -> Row:
        return _Pattern(columns, column, base, np.fromiter(rest, np.int64)).row()

    return picked(len(column), row)


@dataclass
class _Pattern:
    """The candidates (`at`, places in the column) that are like element `base` of it.

    `found` has the candidates' codes for each of the base's codes, `alive` those still alike.
    """

    columns: Columns
    column: Codes
    base: int
    at: NDArray[np.int64]
    found: dict[int, Codes] = field(default_factory=dict)
    leaves: list[int] = field(default_factory=list)
    common: list[int] = field(default_factory=list)
    moving: set[Leaf] = field(default_factory=set)
    shared: dict[str, ca.SX | Progression] = field(default_factory=dict)
    made: dict[int, ca.SX] = field(default_factory=dict)

    def row(self) -> Row:
        """Return the pattern of the base, with all that follow it."""
        root = int(self.column[self.base])
        self.alive: Mask = np.ones(len(self.at), bool)
        if len(self.at) > 1:
            self._compare(root)
            for code in self.leaves:
                self._compare_leaf(code)
            if self.alive.sum() > 1:
                self._set_apart()
                expression = self.columns.expression(root, self.made)
                indices = tuple(int(i) for i in self.at[self.alive])
                return Row(indices, expression, self.base, frozenset(self.moving), self.shared)
        return Row((self.base,), self.columns.expression(root), self.base)

    def _compare(self, root: int) -> None:
        """Compare all operations, down to leaves and to what all candidates have in common."""
        stack = [(root, self.column[self.at])]
        while stack and self.alive.sum() > 1:
            code, there = stack.pop()
            if code in self.found:
                self.alive &= self.found[code] == there
                continue
            self.found[code] = there
            place, index = split(code)
            line = self.columns.source(place)
            if line is None:
                self.leaves.append(code)
            elif self.columns.total(place) or (there[self.alive] == code).all():
                self.alive &= there == code
                self.common.append(code)
            else:
                operands = self._operands(line, there)
                stack.extend(zip(operands_of(line, index), operands, strict=True))

    def _operands(self, line: Line, there: Codes) -> list[Codes]:
        """Return the operands of the candidates, which must have the line's operation."""
        found = [np.full(len(there), -1) for _ in range(arity(line))]
        places, indices = there >> SHIFT, there & ((1 << SHIFT) - 1)
        for place in np.unique(places[self.alive]):
            own = self.alive & (places == place)
            other = self.columns.source(int(place))
            if other is None or other.text != line.text or other.start is not None:
                self.alive &= ~own
                continue
            for column, operand in zip(found, other.operands, strict=False):
                column[own] = operand[indices[own]]
        return found

    def _compare_leaf(self, code: int) -> None:
        """Keep the candidates that have the same leaf, or its neighbour as far away as they are."""
        there, (place, index) = self.found[code], split(code)
        if place == 0:
            self.made[code] = self._constant(code, there, index)
            return
        fixed = self.alive & (there == code)
        moved = self.alive & (there - code == self.at - self.base)
        if moved.sum() > fixed.sum():
            self.alive = moved
            self.moving.add(Leaf(place - 1, index))
        else:
            self.alive = fixed
        self.made[code] = self.columns.leaf(code)

    def _constant(self, code: int, there: Codes, index: int) -> ca.SX:
        values = self.columns.values
        value = values[index]
        constant = self.alive & (there >> SHIFT == 0)
        got = np.where(constant, values[np.where(constant, there, 0)], np.nan)
        same, distance = constant & (got == value), self.at - self.base
        others = np.flatnonzero(constant & (distance != 0))
        if len(others) and not same[others].all():
            nearest = others[np.argmin(np.abs(distance[others]))]
            step = (got[nearest] - value) / distance[nearest]
            grown = constant & (got == value + step * distance)
            whole = float(step).is_integer() and float(value).is_integer()
            if whole and grown.sum() > max(same.sum(), _FEWEST - 1):
                self.alive = grown
                name = f"progression {code}"
                self.shared[name] = Progression(float(value - step * self.base), float(step))
                return ca.SX.sym(name)
        self.alive = same
        return ca.SX(value)

    def _set_apart(self) -> None:
        """Let symbols stand for what is common and has elements that move elsewhere."""
        moving = {leaf.name for leaf in self.moving}
        for code in self.common:
            expression = self.columns.expression(code)
            if moving.intersection(symbol.name() for symbol in ca.symvar(expression)):
                name = f"shared {code}"
                self.shared[name] = expression
                self.made[code] = ca.SX.sym(name)
