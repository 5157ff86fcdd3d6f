"""What a function computes, as loops over its vectors; `loop_tracing` reads it, `loop_code` writes.

CasADi's own C for an MX function copies: scalars that are repeated, slices, vectors that are
joined. Here whatever only moves numbers costs nothing, because each element's place is known when
the C is written: a value is an array of codes, one for each element, that say where it lies. What
computes becomes lines in loops. Lines share a loop if their vectors are equally long, but for one
element, and they read each other's results only from their own turn: then compilers compute several
turns at once. The operations and their order are CasADi's, so the results have the same bits.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.int64]
SHIFT = 32  # code = place · 2³² + index; place 0 holds constants
_LONGEST = 2_000  # lines; what is longer is mostly scalar, where CasADi's own C is as good


class UnsupportedError(Exception):
    """The function holds something that is left to CasADi's own C."""


@dataclass(eq=False)
class Line:
    """One operation on each of `count` elements, or a sum over them if it has a `start`.

    `text` is C with {0}, {1}, … for the operands and {sum} for the sum so far. The result has
    `count` elements, or one for a sum, and stands at `place`.
    """

    text: str
    operands: list[Codes]
    count: int
    start: Codes | None
    place: int
    loop: int = 0

    @property
    def length(self) -> int:
        """Number of elements of the result."""
        return self.count if self.start is None else 1

    @property
    def uses(self) -> list[Codes]:
        """All columns of codes that it reads."""
        return self.operands if self.start is None else [*self.operands, self.start]

    def delays(self, column: Codes) -> Codes:
        """Return how many turns before its own a column takes each of this line's elements."""
        turns = np.flatnonzero(column >> SHIFT == self.place)
        return turns - (column[turns] - (self.place << SHIFT))


@dataclass
class Loops:
    """Lines, each in a numbered loop, and the codes of the function's result.

    Place 0 holds `constants`, the next ones `names`: the C arrays that are given.
    """

    names: Sequence[str]
    constants: list[float] = field(default_factory=list)
    lines: list[Line] = field(default_factory=list)
    result: Codes = field(default_factory=lambda: np.empty(0, np.int64))
    _counts: list[int] = field(default_factory=list)  # of each loop's turns; 0 for a sum

    def constant(self, values: Iterable[float]) -> Codes:
        """Return the codes of numbers."""
        before = len(self.constants)
        self.constants += values
        return np.arange(before, len(self.constants), dtype=np.int64)

    def are_ones(self, column: Codes) -> bool:
        """Return whether all elements of a column are the number 1."""
        return places(column) == [0] and all(self.constants[i] == 1.0 for i in column)

    def source(self, place: int) -> Line | None:
        """Return the line whose result stands at a place; None for what is given."""
        first = len(self.names) + 1
        return self.lines[place - first] if place >= first else None

    def sources(self, column: Codes) -> list[Line]:
        """Return the lines that a column of codes takes elements from."""
        found = (self.source(place) for place in places(column))
        return [line for line in found if line is not None]

    def add(
        self, text: str, operands: Sequence[Codes], count: int, start: Codes | None = None
    ) -> Codes:
        """Add a line in the first loop where it can stand; return its result's codes.

        Operands have `count` elements, or one for all.
        """
        if count == 0:
            return np.empty(0, np.int64)
        columns = [np.repeat(o, count) if len(o) == 1 else o for o in operands]
        if any(len(column) != count for column in columns):
            raise UnsupportedError
        self.require(1)
        line = Line(text, columns, count, start, len(self.names) + 1 + len(self.lines))
        line.loop = self._loop_for(line)
        self.lines.append(line)
        return codes(line.place, line.length)

    def require(self, lines: int) -> None:
        """Raise UnsupportedError if so many lines more are too many."""
        if len(self.lines) + lines > _LONGEST:
            raise UnsupportedError

    def _loop_for(self, line: Line) -> int:
        least = 0
        for column in line.uses:
            for source in self.sources(column):
                least = max(least, source.loop + (not self._can_share(source, line, column)))
        for number, count in enumerate(self._counts[least:], start=least):
            if line.start is None and _is_like(line.count, count):
                return number
        self._counts.append(line.count if line.start is None else 0)
        return len(self._counts) - 1

    def _can_share(self, source: Line, line: Line, column: Codes) -> bool:
        """Whether a line that reads a source in this column can stand in its loop."""
        count = self._counts[source.loop]
        if not _is_like(line.count, count) or not _is_like(source.count, count):
            return False
        are_sums = source.start is not None or line.start is not None
        return not are_sums and not source.delays(column).any()

    def finish(self, result: Codes) -> None:
        """Set the result; drop what it does not need; move lines to where they are used first.

        A line that moves into the loop of its first use needs no array there.
        """
        self.result = result
        users: dict[int, list[tuple[Line, Codes]]] = {}
        needed = {line.place for line in self.sources(result)}
        for line in reversed(self.lines):
            uses = users.get(line.place, [])
            if not uses and line.place not in needed:
                line.loop = -1
                continue
            if uses:
                self._sink(line, uses)
            for column in line.uses:
                for source in self.sources(column):
                    users.setdefault(source.place, []).append((line, column))

    def _sink(self, line: Line, uses: Sequence[tuple[Line, Codes]]) -> None:
        before, line.loop = line.loop, min(user.loop for user, _ in uses)
        first = [(user, column) for user, column in uses if user.loop == line.loop]
        if not all(self._can_share(line, user, column) for user, column in first):
            line.loop = before

    def in_order(self) -> list[list[Line]]:
        """Return the lines of each loop, in the order to run them."""
        found: dict[int, list[Line]] = {}
        for line in self.lines:
            if line.loop >= 0:
                found.setdefault(line.loop, []).append(line)
        return [found[number] for number in sorted(found)]


def codes(place: int, length: int) -> Codes:
    """Return the codes of all elements at a place."""
    return (place << SHIFT) + np.arange(length, dtype=np.int64)


def places(column: Codes) -> list[int]:
    """Return the places that a column of codes refers to."""
    if len(column) == 1:
        return [int(column[0]) >> SHIFT]
    found = column >> SHIFT
    if len(found) and (found == found[0]).all():
        return [int(found[0])]
    return [int(place) for place in np.unique(found)]


def split(code: int) -> tuple[int, int]:
    """Return a code's place and index."""
    return int(code) >> SHIFT, int(code) & ((1 << SHIFT) - 1)


def _is_like(count: int, other: int) -> bool:
    """Whether lines with these numbers of turns may share a loop: single ones only among them."""
    return count == other or (min(count, other) > 1 and abs(count - other) == 1)
