"""A run's numbers, wherever they are: arrays are made when they are asked for."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..clock import Clock

VALUES_AT_ONCE = 1 << 21  # 16 MB: what is written or read in one piece
_EXACT = 2**53  # whole numbers up to here are floats


@dataclass(frozen=True)
class Times:
    """The times of rows: those of the ticks first, first + every, …, `count` of them."""

    clock: Clock
    first: int
    every: int
    count: int

    def array(self, begin: int = 0, end: int | None = None) -> np.ndarray:
        """Return the times (s) of the rows begin ≤ i < end: (a + k·b) / q, divided once."""
        end = self.count if end is None else end
        a, b, q = self.clock.integers
        start, step = a + (self.first + begin * self.every) * b, self.every * b
        rows = end - begin
        if max(abs(start), abs(start + rows * step), q) < _EXACT:
            return np.arange(start, start + rows * step, step, dtype=np.int64) / q
        return np.array([(start + i * step) / q for i in range(rows)])


class Samples(Protocol):
    """Rows of signals: how many, their times (s), and the columns as float64."""

    @property
    def count(self) -> int:
        """The number of rows."""
        ...

    @property
    def time(self) -> np.ndarray:
        """The times in s."""
        ...

    @property
    def values(self) -> np.ndarray:
        """All signals, of shape (rows, columns)."""
        ...

    def column(self, place: int) -> np.ndarray:
        """Return one signal."""
        ...

    def pieces(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Return times and values, some rows at a time."""
        ...


class InMemory:
    """Rows in one or more arrays; of several arrays one is made when all values are asked for."""

    def __init__(self, time: np.ndarray | Times, blocks: list[np.ndarray]) -> None:
        self._time = time
        self._blocks = blocks
        self.count = sum(map(len, blocks))

    @property
    def time(self) -> np.ndarray:
        """The times in s, kept once they have been asked for."""
        if isinstance(self._time, Times):
            self._time = self._time.array()
        return self._time

    @property
    def values(self) -> np.ndarray:
        """All signals, of shape (rows, columns)."""
        if len(self._blocks) > 1:
            self._blocks = [np.concatenate(self._blocks)]
        return self._blocks[0]

    def column(self, place: int) -> np.ndarray:
        """Return one signal: a view where the rows are in one array."""
        columns = [block[:, place] for block in self._blocks]
        return columns[0] if len(columns) == 1 else np.concatenate(columns)

    def pieces(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Return times and values, some rows at a time."""
        begin = 0
        for block in self._blocks:
            rows = max(1, VALUES_AT_ONCE // (1 + block.shape[1]))
            for i in range(0, len(block), rows):
                part = block[i : i + rows]
                end = begin + len(part)
                if isinstance(self._time, Times):
                    yield self._time.array(begin, end), part
                else:
                    yield self._time[begin:end], part
                begin = end
