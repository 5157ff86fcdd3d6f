"""What a run leaves: signals over time with their units, and how it ended."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.errors import FileError, ParameterError, RailcosimError, listing, suggest
from .pacing import PacingReport
from .samples import InMemory, Samples
from .table_file import data_frame, open_parquet, table_writer, typed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


class SimulationError(RailcosimError):
    """A run ended early; `run` holds the rows up to there, with `run.failure` set."""

    def __init__(self, message: str, run: "Run") -> None:
        super().__init__(message)
        self.run = run


def check_target(path: str | Path) -> Path:
    """Return the path of a result to be; raise FileError if it cannot be written there."""
    path = Path(path)
    if path.suffix not in (".parquet", ".csv"):
        raise FileError(f"cannot save to {path}: the name must end in .parquet or .csv")
    if not path.parent.is_dir():
        raise FileError(f"cannot write {path}: no folder {path.parent}")
    return path


@dataclass(frozen=True, init=False, repr=False, eq=False)
class Run:
    """Recorded signals: `time` (s), one column of `values` for each of `columns`.

    The numbers are those given, or come from `samples`, which may read them from a file: then an
    array is made when it is asked for, and `run["block.port"]` reads no other column.

    `types` names the columns that are whole numbers ("int64") or truth values ("bool"). `info`
    says how the run was computed. `wall_time` (s) is not saved.
    """

    name: str
    columns: tuple[str, ...]
    units: Mapping[str, str]
    failure: str | None
    wall_time: float
    types: Mapping[str, str]
    info: Mapping[str, Any]
    pacing: PacingReport | None
    samples: Samples

    def __init__(
        self,
        name: str,
        time: np.ndarray | None = None,
        values: np.ndarray | None = None,
        columns: Sequence[str] = (),
        units: Mapping[str, str] | None = None,
        failure: str | None = None,
        wall_time: float = 0.0,
        *,
        types: Mapping[str, str] | None = None,
        info: Mapping[str, Any] | None = None,
        pacing: PacingReport | None = None,
        samples: Samples | None = None,
    ) -> None:
        if samples is None:
            time = np.empty(0) if time is None else time
            values = np.empty((len(time), len(columns))) if values is None else values
            samples = InMemory(time, [values])
        given = {
            "name": name,
            "columns": tuple(columns),
            "units": dict(units or {}),
            "failure": failure,
            "wall_time": wall_time,
            "types": {c: t for c, t in (types or {}).items() if t != "float64"},
            "info": dict(info or {}),
            "pacing": pacing,
            "samples": samples,
        }
        for key, value in given.items():
            object.__setattr__(self, key, value)

    def __repr__(self) -> str:
        rows = f"{self.samples.count} rows of {len(self.columns)} signals"
        return f"Run({self.name!r}: {rows}{', failed' if self.failure else ''})"

    def __getitem__(self, port: str) -> np.ndarray:
        """Return one signal by its "block.port", in its type."""
        if port not in self.columns:
            raise ParameterError(
                f"no signal '{port}' in this run; signals: {listing(self.columns)}"
                f"{suggest(port, self.columns)}"
            )
        column = self.samples.column(self.columns.index(port))
        return typed(column, self.types.get(port, "float64"))

    @property
    def time(self) -> np.ndarray:
        """The times of the rows in s."""
        return self.samples.time

    @property
    def values(self) -> np.ndarray:
        """All signals as floats: an array of shape (rows, columns)."""
        return self.samples.values

    @cached_property
    def frame(self) -> "pd.DataFrame":
        """The signals as a pandas DataFrame, in their types; the index is the time in s."""
        kinds = [self.types.get(c, "float64") for c in self.columns]
        return data_frame(self.time, self.values, self.columns, kinds)

    @property
    def engine(self) -> str:
        """Which engine computed the run: "python" or "compiled"; "" if that is not known."""
        return str(self.info.get("engine", ""))

    @property
    def algorithm(self) -> str:
        """The co-simulation algorithm, as text; "" if that is not known."""
        return str(self.info.get("algorithm", ""))

    def renamed(self, names: Mapping[str, str]) -> "Run":
        """Return the same rows with columns under new names; those without one keep theirs."""

        def by_name(values: Mapping[str, str]) -> dict[str, str]:
            return {names.get(c, c): value for c, value in values.items()}

        return Run(
            self.name,
            columns=[names.get(c, c) for c in self.columns],
            units=by_name(self.units),
            failure=self.failure,
            wall_time=self.wall_time,
            types=by_name(self.types),
            info=self.info,
            pacing=self.pacing,
            samples=self.samples,
        )

    def meta(self) -> dict[str, Any]:
        """Return what a result file's metadata say of the run, beside its columns' types."""
        return {
            "name": self.name,
            "units": dict(self.units),
            "failure": self.failure,
            "info": dict(self.info),
            "pacing": None if self.pacing is None else self.pacing.to_dict(),
        }

    def save(self, path: str | Path) -> Path:
        """Write to .parquet (units and the rest in the schema's metadata) or .csv; return the path.

        In CSV the first line holds the names and numbers are written so that they read back to
        the same bits, truth values as 1 and 0; the units do not go in. A file that stood there
        is replaced when the new one is complete.
        """
        path = check_target(path)
        meta = self.meta()
        writer = table_writer(path, self.columns, self.units, self.types, meta)
        try:
            for time, values in self.samples.pieces():
                writer.write(time, values)
            writer.close(meta)
        except BaseException:
            writer.abort()
            raise
        return path

    @classmethod
    def load(cls, path: str | Path, *, lazy: bool = False) -> "Run":
        """Read a run that was saved or recorded as Parquet; raise FileError for another file.

        With `lazy` the numbers stay in the file until they are asked for, column by column.
        """
        stored, meta, types = open_parquet(Path(path))
        pacing = meta.get("pacing")
        return cls(
            meta["name"],
            columns=stored.columns,
            units=meta["units"],
            failure=meta["failure"],
            types=types,
            info=meta.get("info"),
            pacing=None if pacing is None else PacingReport.from_dict(pacing),
            samples=stored if lazy else stored.loaded(),
        )

    def scope(self, *ports: str) -> "Figure":
        """Return a figure of these signals (default: all) over time, one axis for each unit."""
        from .scope import scope

        return scope(self, ports or self.columns)
