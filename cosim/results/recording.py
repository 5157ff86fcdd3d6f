"""What a run keeps: which ports, how often, in memory or in a file; and the keeper of the rows."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral
from pathlib import Path
from typing import Any

import numpy as np

from ...base.errors import DiagramError, ParameterError, RailcosimError, listing, suggest
from ..clock import Clock
from .pacing import PacingReport
from .result import Run, check_target
from .samples import VALUES_AT_ONCE, InMemory, Times
from .table_file import stored, table_writer

_BLOCK = 1 << 20  # values in a block where it is not known how many there will be


@dataclass(frozen=True, slots=True)
class Recording:
    """Keep these outputs ("block.port"; None: all) at every n-th tick.

    The ticks are counted from the run's start: N steps give N // every + 1 rows, and the last row
    is that of the stop only if the count goes up. `to` names a .parquet (or .csv) file that the
    rows are written to while the run goes on, so that memory stays flat; until it is complete its
    name ends in .part.
    """

    ports: Sequence[str] | None = None
    every: int = 1
    to: str | Path | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        if self.ports is not None:
            names = port_names(self.ports, "Recording")
            twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
            if twice:
                raise ParameterError(f"Recording: {listing(twice)} named twice")
            object.__setattr__(self, "ports", names)
        require_every(self.every, "Recording")
        if self.to is not None:
            object.__setattr__(self, "to", check_target(self.to))

    @classmethod
    def of(cls, record: "Recording | Sequence[str] | None") -> "Recording":
        """Return what `record` of a run stands for: a Recording, a list of ports, or None."""
        return record if isinstance(record, Recording) else cls(record)

    def places(self, signals: Sequence[str], diagram: str) -> list[int]:
        """Return where the ports are among a plan's signals; raise DiagramError if one is not."""
        if self.ports is None:
            return list(range(len(signals)))
        return signal_places(self.ports, signals, "record", diagram)


def port_names(ports: Any, what: str) -> tuple[str, ...]:
    """Return ports as a tuple; raise ParameterError unless they are several names."""
    if isinstance(ports, Sequence) and not isinstance(ports, str):
        names = tuple(ports)
        if all(isinstance(name, str) for name in names):
            return names
    raise ParameterError(f"{what}: ports must be a list of names 'block.port', not {ports!r}")


def require_every(every: Any, what: str) -> None:
    """Raise ParameterError unless `every` is a whole number from 1."""
    if not isinstance(every, Integral) or isinstance(every, bool) or every < 1:
        raise ParameterError(f"{what}: every must be a whole number of ticks, not {every!r}")


def signal_places(
    ports: Sequence[str], signals: Sequence[str], doing: str, diagram: str
) -> list[int]:
    """Return the places of ports among signals; raise DiagramError for one that is not there."""
    place = {name: i for i, name in enumerate(signals)}
    for name in ports:
        if name not in place:
            raise DiagramError(
                f"no signal '{name}' to {doing} in '{diagram}'; signals: {listing(signals)}"
                f"{suggest(name, signals)}"
            )
    return [place[name] for name in ports]


class Recorder:
    """The rows of one run, written in place by the engine: `buffer(n)`, fill it, `keep(n)`.

    Rows belong to the ticks first ≤ k ≤ first + ticks with k % every == 0; `ticks` is None where
    the end is not known. In memory they stand in one array that was made for all of them; with
    `recording.to` in one of a bounded size, which goes to the file whenever it is full.

    `columns` are the signals' names, `units` and `types` those that have any: a type is "float64"
    (default), "int64" or "bool". Raise ParameterError where memory cannot hold the rows.
    """

    def __init__(
        self,
        columns: Sequence[str],
        units: Mapping[str, str],
        types: Mapping[str, str],
        clock: Clock,
        ticks: int | None,
        recording: Recording | None = None,
        *,
        name: str = "",
        first: int = 0,
    ) -> None:
        self.recording = recording or Recording()
        self.name, self.columns, self.clock = name, tuple(columns), clock
        self.units = {c: units[c] for c in self.columns if c in units}
        self.types = {c: types[c] for c in self.columns if c in types}
        self.rows = 0  # kept so far
        self.every = self.recording.every
        self.first = -(-first // self.every) * self.every  # the tick of the first row
        self._blocks: list[np.ndarray] = []
        self._filled = 0  # rows of the last block
        self._file: Any = None
        self._closed = False
        width = 1 + len(self.columns)  # with the times
        if self.recording.to is not None:
            target = Path(self.recording.to)
            self._file = table_writer(target, self.columns, self.units, self.types)
            size = max(1, VALUES_AT_ONCE // width)
            if ticks is not None:
                size = min(size, self.count(first, first + ticks + 1))
        elif ticks is None:
            size = max(1, _BLOCK // width)
        else:
            size = self.count(first, first + ticks + 1)
        self._add_block(size)
        # What one buffer should hold at most, for flat memory; a larger one is given, too.
        self.limit = max(1, size) if self._file is not None else sys.maxsize

    def count(self, begin: int, end: int) -> int:
        """Return the number of rows at the ticks begin ≤ k < end."""
        return -(-end // self.every) - -(-begin // self.every)

    def tick(self, row: int) -> int:
        """Return the tick of a row, counted from the first one kept."""
        return self.first + row * self.every

    def buffer(self, count: int) -> np.ndarray:
        """Return the memory of the next rows, float64 of shape (count, columns), to be filled.

        It may be filled until the next call; only `keep` makes rows of it.
        """
        if self._closed:
            raise RailcosimError("the recording has been closed; a file takes no more rows")
        if self._filled + count > len(self._blocks[-1]):
            self._make_room(count)
        return self._blocks[-1][self._filled : self._filled + count]

    def keep(self, count: int) -> None:
        """Keep the first `count` rows of the last buffer; −1 takes the row just kept back."""
        self._filled += count
        self.rows += count

    def close(
        self,
        failure: str | None = None,
        *,
        info: Mapping[str, Any] | None = None,
        pacing: PacingReport | None = None,
    ) -> None:
        """End the recording and complete its file; a second call does nothing.

        Raise FileError if the file cannot be written.
        """
        if self._closed or self._file is None:
            return
        self._closed = True
        self._flush()
        self._file.close(self._run(failure, info, pacing, 0.0).meta())

    def result(
        self,
        failure: str | None = None,
        *,
        info: Mapping[str, Any] | None = None,
        pacing: PacingReport | None = None,
        wall_time: float = 0.0,
    ) -> Run:
        """Return the rows kept so far as a Run. A file is closed by it; in memory more may come."""
        self.close(failure, info=info, pacing=pacing)
        return self._run(failure, info, pacing, wall_time)

    def _run(
        self,
        failure: str | None,
        info: Mapping[str, Any] | None,
        pacing: PacingReport | None,
        wall_time: float,
    ) -> Run:
        times = Times(self.clock, self.first, self.every, self.rows)
        samples: Any
        if self.recording.to is not None:
            samples = stored(Path(self.recording.to), self.columns, times)
        else:
            samples = InMemory(times, self._kept())
        return Run(
            self.name,
            columns=self.columns,
            units=self.units,
            failure=failure,
            wall_time=wall_time,
            types=self.types,
            info=info,
            pacing=pacing,
            samples=samples,
        )

    def _kept(self) -> list[np.ndarray]:
        last = self._blocks[-1]
        kept = last[: self._filled]
        if 2 * self._filled < len(last):  # a run that ended early does not keep it all
            kept = kept.copy()
        return [*self._blocks[:-1], kept]

    def _make_room(self, count: int) -> None:
        last = self._blocks[-1]
        if self._file is not None:
            self._flush()
            if count > len(last):
                self._blocks.clear()
                self._add_block(count)
            return
        self._blocks[-1] = last[: self._filled]
        self._filled = 0
        self._add_block(max(count, _BLOCK // (1 + len(self.columns))))

    def _flush(self) -> None:
        begin = self.rows - self._filled
        if self._filled:
            times = Times(self.clock, self.tick(begin), self.every, self._filled)
            rows, self._filled = self._blocks[-1][: self._filled], 0
            try:
                self._file.write(times.array(), rows)
            except BaseException:
                self._closed = True
                self._file.abort()
                raise

    def _add_block(self, rows: int) -> None:
        try:
            self._blocks.append(np.empty((rows, len(self.columns))))
        except (MemoryError, ValueError, OverflowError):
            size = 8.0 * rows * len(self.columns) / 1e9
            raise ParameterError(
                f"{rows} rows of {len(self.columns)} signals need {size:.3g} GB of memory; record "
                "fewer ports or ticks, or into a file: Recording(…, every=…, to='run.parquet')"
            ) from None
