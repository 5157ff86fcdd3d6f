"""Result files, .parquet and .csv: written some rows at a time, read when asked for."""

import json
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ...base.errors import FileError
from .samples import VALUES_AT_ONCE, InMemory, Times

if TYPE_CHECKING:
    import pandas as pd

_META = b"railcosim"


class TableWriter(Protocol):
    """A file that grows; until `close` has completed it, its name ends in .part."""

    def write(self, time: np.ndarray, values: np.ndarray) -> None:
        """Append rows; raise FileError, and leave no file, if that is not possible."""
        ...

    def close(self, meta: Mapping[str, Any]) -> None:
        """Complete the file with what is known of the run, and give it its name."""
        ...

    def abort(self) -> None:
        """Remove the incomplete file."""
        ...


def typed(column: np.ndarray, kind: str) -> np.ndarray:
    """Return a float column in its type: "float64" (as it is), "int64" or "bool"."""
    if kind == "float64":
        return column
    return column != 0.0 if kind == "bool" else np.rint(column).astype(np.int64)


def table_writer(
    path: Path,
    columns: Sequence[str],
    units: Mapping[str, str],
    types: Mapping[str, str],
    meta: Mapping[str, Any] | None = None,
) -> TableWriter:
    """Open a .parquet or .csv file; `meta`, if known already, goes into the schema as well."""
    if "time" in columns:
        raise FileError(f"cannot write {path}: a signal is named 'time', as the times' column is")
    kinds = [types.get(name, "float64") for name in columns]
    if path.suffix == ".csv":
        return _CsvWriter(path, columns, kinds)
    return _ParquetWriter(path, columns, kinds, units, meta)


class _Writer(ABC):
    """What the two have in common: the temporary name, and errors of the system as FileError."""

    def __init__(self, path: Path, columns: Sequence[str], kinds: Sequence[str]) -> None:
        self.path, self.columns, self.kinds = path, tuple(columns), kinds
        self.part = path.with_name(path.name + ".part")
        self.sink: Any = None

    def write(self, time: np.ndarray, values: np.ndarray) -> None:
        """Append rows."""
        with self._guarded():
            self._append(time, values)

    def close(self, meta: Mapping[str, Any]) -> None:
        """Complete the file and give it its name."""
        with self._guarded():
            self._end(meta)
            self.sink.close()
            self.part.replace(self.path)

    def abort(self) -> None:
        """Remove the incomplete file."""
        with suppress(Exception):  # it is the first error that matters
            if self.sink is not None:
                self.sink.close()
        with suppress(OSError):
            self.part.unlink(missing_ok=True)

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            self.abort()
            words = error.strerror or error
            raise FileError(f"cannot write {self.path}: {words}") from error

    @abstractmethod
    def _append(self, time: np.ndarray, values: np.ndarray) -> None:
        """Write some rows."""

    def _end(self, meta: Mapping[str, Any]) -> None:  # noqa: B027 (a text file has none)
        """Write what belongs to the file's end."""


class _ParquetWriter(_Writer):
    def __init__(
        self,
        path: Path,
        columns: Sequence[str],
        kinds: Sequence[str],
        units: Mapping[str, str],
        meta: Mapping[str, Any] | None,
    ) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        super().__init__(path, columns, kinds)
        arrow = {"float64": pa.float64(), "int64": pa.int64(), "bool": pa.bool_()}
        rows = [("time", "float64", "s")]
        rows += [(n, k, units.get(n, "")) for n, k in zip(columns, kinds, strict=True)]
        fields = [pa.field(n, arrow[kind], metadata={"unit": unit}) for n, kind, unit in rows]
        self.schema = pa.schema(fields)
        if meta is not None:
            self.schema = self.schema.with_metadata({_META: _text(meta)})
        with self._guarded():
            # A dictionary is of no use to floats that hardly repeat, and costs most of the time.
            self.sink = pq.ParquetWriter(
                self.part, self.schema, compression="zstd", use_dictionary=False
            )

    def _append(self, time: np.ndarray, values: np.ndarray) -> None:
        import pyarrow as pa

        arrays = [pa.array(time)]
        for i, kind in enumerate(self.kinds):
            arrays.append(pa.array(typed(values[:, i], kind)))
        self.sink.write_batch(pa.record_batch(arrays, schema=self.schema))

    def _end(self, meta: Mapping[str, Any]) -> None:
        self.sink.add_key_value_metadata({_META: _text(meta)})


class _CsvWriter(_Writer):
    """Names in the first line; numbers read back to the same bits; a Boolean is 1 or 0."""

    def __init__(self, path: Path, columns: Sequence[str], kinds: Sequence[str]) -> None:
        super().__init__(path, columns, kinds)
        with self._guarded():
            self.sink = self.part.open("w", encoding="utf-8", newline="")
            self._frame(np.empty(0), np.empty((0, len(columns)))).to_csv(self.sink)

    def _append(self, time: np.ndarray, values: np.ndarray) -> None:
        self._frame(time, values).to_csv(self.sink, header=False)

    def _frame(self, time: np.ndarray, values: np.ndarray) -> "pd.DataFrame":
        return data_frame(
            time, values, self.columns, ["int64" if k == "bool" else k for k in self.kinds]
        )


def data_frame(
    time: np.ndarray, values: np.ndarray, columns: Sequence[str], kinds: Sequence[str]
) -> "pd.DataFrame":
    """Return signals as a pandas DataFrame; the index is the time in s."""
    import pandas as pd

    index = pd.Index(time, name="time")
    if all(kind == "float64" for kind in kinds):
        return pd.DataFrame(values, index=index, columns=list(columns))
    found = [pd.Series(typed(values[:, i], k), index=index) for i, k in enumerate(kinds)]
    return pd.concat(found, axis=1, keys=list(columns))


def _text(meta: Mapping[str, Any]) -> str:
    return json.dumps(meta, allow_nan=True)


def stored(path: Path, columns: Sequence[str], times: Times) -> "_Stored":
    """Return the rows of a file that a run has been recorded into, to be read when asked for."""
    made = _StoredCsv if path.suffix == ".csv" else _StoredParquet
    return made(path, columns, times.count, times)


class _Stored(ABC):
    """Rows in a file. Its times and all its values are kept once they have been asked for."""

    def __init__(
        self, path: Path, columns: Sequence[str], count: int, times: Times | None = None
    ) -> None:
        self.path, self.columns, self.count = path, tuple(columns), count
        self._times = times
        self._time: np.ndarray | None = None
        self._values: np.ndarray | None = None

    @property
    def time(self) -> np.ndarray:
        """The times in s."""
        if self._time is None:
            self._time = self._times.array() if self._times else self._read("time")
        return self._time

    @property
    def values(self) -> np.ndarray:
        """All signals, of shape (rows, columns)."""
        if self._values is None:
            values = np.empty((self.count, len(self.columns)))
            for i, name in enumerate(self.columns):
                values[:, i] = self._read(name)
            self._values = values
        return self._values

    def column(self, place: int) -> np.ndarray:
        """Return one signal."""
        if self._values is not None:
            return self._values[:, place]
        return self._read(self.columns[place])

    def loaded(self) -> InMemory:
        """Return all of it, in memory."""
        return InMemory(self.time, [self.values])

    @abstractmethod
    def pieces(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Return times and values, some rows at a time."""

    @abstractmethod
    def _read(self, name: str) -> np.ndarray:
        """Return one column."""

    @contextmanager
    def _reading(self) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError) as error:
            raise FileError(f"cannot read {self.path}: {error}") from error


class _StoredParquet(_Stored):
    def _read(self, name: str) -> np.ndarray:
        import pyarrow.parquet as pq

        with self._reading(), pq.ParquetFile(self.path) as file:
            # The reader takes "a.b" for "a.b.c" as well: pick the column out of what it returns.
            column = file.read(columns=[name]).column(name)
            return column.to_numpy().astype(np.float64, copy=False)

    def pieces(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Return times and values, some rows at a time."""
        import pyarrow.parquet as pq

        rows = max(1, VALUES_AT_ONCE // (1 + len(self.columns)))
        with self._reading(), pq.ParquetFile(self.path) as file:
            for batch in file.iter_batches(rows):
                values = np.empty((batch.num_rows, len(self.columns)))
                for i, name in enumerate(self.columns):
                    values[:, i] = batch.column(name).to_numpy(zero_copy_only=False)
                yield batch.column("time").to_numpy(), values


class _StoredCsv(_Stored):
    # Of the readers at hand this one's numbers are exact with every version.

    def _read(self, name: str) -> np.ndarray:
        from pyarrow import csv

        with self._reading():
            table = csv.read_csv(self.path, convert_options=self._options([name]))
            return table.column(name).to_numpy()

    def pieces(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Return times and values, some rows at a time."""
        from pyarrow import csv

        options = self._options(["time", *self.columns])
        with self._reading(), csv.open_csv(self.path, convert_options=options) as reader:
            for batch in reader:
                columns = [c.to_numpy(zero_copy_only=False) for c in batch.columns]
                values = np.empty((batch.num_rows, len(self.columns)))
                for i, column in enumerate(columns[1:]):
                    values[:, i] = column
                yield columns[0], values

    def _options(self, names: list[str]) -> Any:
        import pyarrow as pa
        from pyarrow import csv

        types = dict.fromkeys(names, pa.float64())
        return csv.ConvertOptions(include_columns=names, column_types=types)


def open_parquet(path: Path) -> tuple[_StoredParquet, dict[str, Any], dict[str, str]]:
    """Return a result file's rows, what its metadata say of the run, and the columns' types.

    Raise FileError for a file that is none of these.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not path.is_file():
        raise FileError(f"no file {path}")
    try:
        with pq.ParquetFile(path) as file:
            schema, count = file.schema_arrow, file.metadata.num_rows
            text = (file.metadata.metadata or {}).get(_META)
    except (OSError, pa.ArrowInvalid) as error:
        raise FileError(f"cannot read {path} as Parquet: {error}") from error
    if text is None:
        raise FileError(f"{path} was not written by railcosim")
    types = {}
    for field in schema:
        if pa.types.is_boolean(field.type):
            types[field.name] = "bool"
        elif pa.types.is_integer(field.type):
            types[field.name] = "int64"
    columns = [name for name in schema.names if name != "time"]
    return _StoredParquet(path, columns, count), json.loads(text), types
