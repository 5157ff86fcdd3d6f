"""The C of loops: `Writer` gives one function's statements."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from .loops import Codes, Line, Loops, UnsupportedError, codes, places, split

_PIECES = 12  # a loop that would fall into more pieces is left to CasADi's C
_Place = tuple[str, int, int]  # array, first element, step


class Writer:
    """Writes a function's statements: from the given arrays, by way of w, to `result`."""

    def __init__(self, loops: Loops) -> None:
        self.loops = loops
        self.work = 0  # elements of w in use
        self._kept: dict[int, _Place] = {}  # arrays of results that are needed as arrays
        groups = loops.in_order()
        copied = self._write_to_result()
        for group in groups:
            self._keep_for(group)
        for line in loops.sources(loops.result[copied]):
            self._keep(line)
        self.statements = [text for group in groups for text in self._loop(group)]
        self.statements += self._copies(copied)
        if any("constants[" in text for text in self.statements):
            numbers = ", ".join(map(_literal, loops.constants))
            self.statements.insert(0, f"static const double constants[] = {{{numbers}}};")

    def _write_to_result(self) -> Codes:
        """Let lines write to `result` where they can; return the positions that remain."""
        column = self.loops.result
        remain = np.ones(len(column), bool)
        for line in self.loops.sources(column):
            own = codes(line.place, line.length)
            at = np.flatnonzero((column >= own[0]) & (column <= own[-1]))
            whole = line.length > 1 and np.array_equal(column[at], own)
            if whole and not _cuts(at):
                self._kept[line.place] = ("result", int(at[0]), int(at[1] - at[0]))
                remain[at] = False
        return np.flatnonzero(remain)

    def _keep_for(self, group: Sequence[Line]) -> None:
        for line in group:
            for column in line.uses:
                for source in self.loops.sources(column):
                    if source.loop != line.loop:
                        self._keep(source)

    def _keep(self, line: Line) -> None:
        if line.length > 1 and line.place not in self._kept:
            self._kept[line.place] = ("w", self.work, 1)
            self.work += line.length

    def _loop(self, group: Sequence[Line]) -> Iterator[str]:
        for line in group:
            if line.start is not None:
                yield f"double {_name(line)} = {self._element(line, line.start, 0, 1)};"
        columns = [column for line in group for column in line.operands]
        pieces = _pieces(columns, [line.count for line in group])
        for first, last in pieces if group[0].start is not None else _even(pieces):
            there = [line for line in group if line.count > first]
            inside = [text for line in there for text in self._line(line, first, last)]
            if group[0].count == 1 and group[0].start is None:
                yield from inside
            else:
                yield _head(first, last)
                yield from (f"    {text}" for text in inside)
                yield "}"

    def _line(self, line: Line, first: int, last: int) -> Iterator[str]:
        """Yield the statements of one line on the elements from `first` to before `last`."""
        operands = [self._element(line, column, first, last) for column in line.operands]
        text = line.text.format(*operands, sum=_name(line))
        if line.start is not None:
            yield f"{_name(line)} = {text};"
            return
        yield f"const double {_name(line)} = {text};"
        if line.place in self._kept:
            array, at, step = self._kept[line.place]
            yield f"{array}[{_index(at, step, first, last)}] = {_name(line)};"

    def _copies(self, positions: Codes) -> Iterator[str]:
        """Yield the statements that copy to `result` what no line has written there."""
        column = self.loops.result[positions]
        for first, last in _pieces([column, positions], [len(column)], len(column)):
            step = int(positions[first + 1] - positions[first]) if last - first > 1 else 0
            at = _index(int(positions[first]) - step * first, step, first, last)
            text = f"result[{at}] = {self._element(None, column, first, last)};"
            if last - first > 1:
                yield _head(first, last)
                yield f"    {text}"
                yield "}"
            else:
                yield text

    def _element(self, line: Line | None, column: Codes, first: int, last: int) -> str:
        """Return the C for element i of a line's column, which is regular here."""
        place, index = split(column[first])
        step = int(column[first + 1] - column[first]) if last - first > 1 else 0
        source = self.loops.source(place)
        if source is not None and source.length == 1:
            return _name(source)
        if source is not None and line is not None and source.loop == line.loop:
            return _name(source)
        if place == 0:
            if step == 0:
                return _literal(self.loops.constants[index])
            array, at, stride = "constants", 0, 1
        elif source is None:
            array, at, stride = self.loops.names[place - 1], 0, 1
        else:
            array, at, stride = self._kept[place]
        start = at + stride * (index - step * first)
        return f"{array}[{_index(start, stride * step, first, last)}]"


def _name(line: Line) -> str:
    return f"a{line.place}"


def _head(first: int, last: int) -> str:
    return "{" if last - first == 1 else f"for (int i = {first}; i < {last}; i++) {{"


def _index(at: int, step: int, first: int, last: int) -> str:
    """Return at + step · i as C, or its value if the piece has one element."""
    if step == 0 or last - first == 1:
        return str(at + step * first)
    scaled = "i" if step == 1 else f"{step} * i"
    return scaled if at == 0 else f"{scaled} {'+' if at > 0 else '-'} {abs(at)}"


def _literal(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "HUGE_VAL" if value > 0 else "(-HUGE_VAL)"
    return repr(value) if value >= 0 and math.copysign(1.0, value) > 0 else f"({value!r})"


def _pieces(
    columns: Sequence[Codes], counts: Sequence[int], most: int = _PIECES
) -> list[tuple[int, int]]:
    """Return the index ranges in which all columns are regular and equally many are left."""
    cuts = sorted({0, *counts}.union(*(_cuts(column) for column in columns)))
    if len(cuts) - 1 > most:
        raise UnsupportedError
    return list(pairwise(cuts))


def _even(pieces: Sequence[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """Yield the pieces, the last turn of an odd one apart.

    At -O2, GCC computes two elements at a time only if none is left over.
    """
    for first, last in pieces:
        middle = last - (last - first) % 2
        if first < middle < last:
            yield first, middle
            yield middle, last
        else:
            yield first, last


def _cuts(column: Codes) -> list[int]:
    """Return where a new regular piece begins: equal steps at one place."""
    steps = np.diff(column)
    if not len(steps) or (len(places(column)) == 1 and (steps == steps[0]).all()):
        return []
    moves = np.diff([split(code)[0] for code in column]) != 0
    cuts, start = [], 0
    while start < len(steps):
        ends = moves[start:] | (steps[start:] != (steps[start] if not moves[start] else -1))
        found = np.flatnonzero(ends)
        if not len(found):
            break
        start += int(found[0]) + 1
        cuts.append(start)
    return cuts
