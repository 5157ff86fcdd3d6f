"""Expressions as columns of codes, read from CasADi's vectors: quick at any length.

See `fmus.loops`: a code says which element of which line (or argument) a number is. Only what is
shown becomes a scalar expression.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ..loop_tracing import OPERATIONS, trace
from ..loops import SHIFT, Codes, Line, Loops, UnsupportedError, codes, places, split
from .nodes import UnprintableError

_TOTAL = "total "  # begins the names of symbols that stand for totals
_MOST_LINES = 50_000
_LARGEST = 10_000  # operations of one expression; more would take long, and nobody reads them
_CODES = {text: code for code, text in reversed(OPERATIONS.items())}
_CODES["{0}"] = ca.OP_ASSIGN
# What sums and the like put together, and how.
_TERMS: dict[str, tuple[str, int]] = {
    "{sum} + {0}": ("{0}", ca.OP_ADD),
    "{sum} + {0} * {1}": ("{0} * {1}", ca.OP_ADD),
    "{sum} + {0} * {0}": ("{0} * {0}", ca.OP_ADD),
    "{sum} + fabs({0})": ("fabs({0})", ca.OP_ADD),
    "larger({sum}, {0})": ("{0}", ca.OP_FMAX),
    "larger({sum}, fabs({0}))": ("fabs({0})", ca.OP_FMAX),
    "smaller({sum}, {0})": ("{0}", ca.OP_FMIN),
}
_STARTS = {ca.OP_ADD: 0.0, ca.OP_FMAX: -np.inf, ca.OP_FMIN: np.inf}


@dataclass(frozen=True)
class Total:
    """A sum, minimum or maximum (`code` is CasADi's operation) of all elements of a column."""

    column: Codes
    code: int


class Columns(Loops):
    """Lines in the order of their operations; there are no loops, and a sum has one operand.

    `symbols` are the arguments' as scalars: element i of argument k is `symbols[k][i]`.
    """

    def __init__(self, symbols: Sequence[ca.SX]) -> None:
        super().__init__([str(k) for k in range(len(symbols))])
        self._symbols = [ca.vertsplit(symbol) for symbol in symbols]
        self._values: np.ndarray = np.empty(0)
        self._totals: list[Total | None] = []  # of the lines, as far as they were asked for

    def traced(self, function: ca.Function) -> list[Codes] | None:
        """Return a function's results, None if they have no such form."""
        before = len(self.lines)
        given = [codes(k + 1, len(elements)) for k, elements in enumerate(self._symbols)]
        try:
            return trace(self, function, given)
        except UnsupportedError:
            del self.lines[before:]
            return None

    def add(
        self, text: str, operands: Sequence[Codes], count: int, start: Codes | None = None
    ) -> Codes:
        """Add a line; return its result's codes."""
        if count == 0:
            return np.empty(0, np.int64)
        columns = [np.repeat(o, count) if len(o) == 1 else o for o in operands]
        if any(len(column) != count for column in columns):
            raise UnsupportedError
        if start is not None:
            if text not in _TERMS:
                raise UnsupportedError
            term = _TERMS[text][0]
            if term == "{0} * {1}":
                factors = [column for column in columns if not self._is_one(column)]
                term, columns = ("{0}", factors) if len(factors) == 1 else (term, columns)
            columns = columns if term == "{0}" else [self.add(term, columns, count)]
        elif text == "{0}":
            return columns[0]
        self.require(1)
        line = Line(text, columns, count, start, len(self.names) + 1 + len(self.lines))
        self.lines.append(line)
        return codes(line.place, line.length)

    def require(self, lines: int) -> None:
        """Raise UnsupportedError if so many lines more are too many."""
        if len(self.lines) + lines > _MOST_LINES:
            raise UnsupportedError

    def _is_one(self, column: Codes) -> bool:
        return places(column) == [0] and bool((self.values[column] == 1.0).all())

    @property
    def values(self) -> np.ndarray:
        """The constants by their index."""
        if len(self._values) != len(self.constants):
            self._values = np.array(self.constants, float)
        return self._values

    def total(self, place: int) -> Total | None:
        """Return what the line at a place puts together, None if it is no total.

        A total may be made of partial ones of one column: the order of adding is not shown.
        """
        first = len(self.names) + 1
        while first + len(self._totals) <= place:  # one may be made of those before it
            self._totals.append(self._total(self.lines[len(self._totals)]))
        return self._totals[place - first] if place >= first else None

    def _total(self, line: Line) -> Total | None:
        if line.start is None:
            return self._joined(line)
        (column,), code = line.operands, _TERMS[line.text][1]
        column = self._spread(column, code)
        start, index = split(line.start[0])
        if start == 0 and self.constants[index] == _STARTS[code]:
            return Total(column, code)
        return Total(np.concatenate([line.start, column]), code)

    def _spread(self, column: Codes, code: int) -> Codes:
        """Return the elements of one column that are added (…) in pieces, else the column."""
        for last in self._halves(column, code) or ():
            pieces: list[Codes] = []
            stack = [column]
            while stack:
                piece = stack.pop()
                halves = None if places(piece) == places(last) else self._halves(piece, code)
                pieces += [] if halves else [piece]
                stack += halves or []
            united = _united(pieces)
            if united is not None:
                return united
        return column

    def _halves(self, column: Codes, code: int) -> list[Codes] | None:
        """Return the operands of a column that is all one line's with this operation."""
        place, *others = places(column)
        line = self.source(place)
        if others or line is None or line.start is not None or _CODES[line.text] != code:
            return None
        return [operand[column - (place << SHIFT)] for operand in reversed(line.operands)]

    def _joined(self, line: Line) -> Total | None:
        """Return the total that is one operation on totals, or on one and another element."""
        code = _CODES[line.text]
        if line.count > 1 or code not in _STARTS:
            return None
        pair = [(operand, self.total(split(operand[0])[0])) for operand in line.operands]
        if not any(total for _, total in pair):
            return None
        if any(total and total.code != code for _, total in pair):
            return None
        column = _united([total.column if total else operand for operand, total in pair])
        return None if column is None else Total(column, code)

    def leaf(self, code: int) -> ca.SX:
        """Return what has no line: a constant or an argument's element."""
        place, index = split(code)
        return self._symbols[place - 1][index] if place else ca.SX(self.constants[index])

    def made(self, line: Line, operands: Sequence[ca.SX]) -> ca.SX:
        """Return a line's operation on scalars."""
        make = ca.SX.unary if len(operands) == 1 else ca.SX.binary
        return make(_CODES[line.text], *operands)

    def expression(self, code: int, known: dict[int, ca.SX] | None = None) -> ca.SX:
        """Return one element as a scalar expression, in which symbols stand for totals.

        `known` are expressions by their codes, and grows. Raise UnprintableError.
        """
        known = {} if known is None else known
        stack = [(code, False)]
        while stack:
            at, finished = stack.pop()
            if at in known:
                continue
            place, index = split(at)
            line = self.source(place)
            if line is None:
                known[at] = self.leaf(at)
            elif self.total(place):
                known[at] = ca.SX.sym(f"{_TOTAL}{place}")
            else:
                below = operands_of(line, index)
                if finished:
                    known[at] = self.made(line, [known[b] for b in below])
                else:
                    stack.append((at, True))
                    stack.extend((b, False) for b in below)
            if len(known) > _LARGEST:
                raise UnprintableError
        return known[code]

    def chain(self, total: Total) -> ca.SX:
        """Return a total as a scalar expression; raise UnprintableError."""
        known: dict[int, ca.SX] = {}
        first, *others = (self.expression(int(code), known) for code in total.column)
        for other in others:
            first = ca.SX.binary(total.code, first, other)
        return first


def arity(line: Line) -> int:
    """Return how many operands a line's operation has."""
    return 2 if "{1}" in line.text else 1


def operands_of(line: Line, index: int) -> list[int]:
    """Return the codes that one element of a line is made of."""
    return [int(column[index]) for column in line.operands[: arity(line)]]


def total_place(name: str) -> int | None:
    """Return the place of the total that a symbol stands for, None for other symbols."""
    return int(name.removeprefix(_TOTAL)) if name.startswith(_TOTAL) else None


def _united(pieces: Sequence[Codes]) -> Codes | None:
    """Return all elements of pieces in their order, None if these are not of one column."""
    known = [set(places(piece)) for piece in pieces]
    whole = max(known, key=len)
    joined = np.unique(np.concatenate(pieces))
    is_one = all(found <= whole for found in known) and len(joined) == sum(map(len, pieces))
    return joined if is_one else None
