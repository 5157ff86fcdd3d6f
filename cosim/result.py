"""What a run leaves: signals over time with their units, and how it ended."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import FileError, ParameterError, RailcosimError, listing, suggest

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_META = b"railcosim"


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


@dataclass(frozen=True)
class Run:
    """Recorded signals: `time` (s), one column of `values` for each of `columns`."""

    name: str
    time: np.ndarray
    values: np.ndarray
    columns: tuple[str, ...]
    units: Mapping[str, str]
    failure: str | None = None
    wall_time: float = field(default=0.0, compare=False)  # s; not saved

    def __repr__(self) -> str:
        rows = f"{len(self.time)} rows of {len(self.columns)} signals"
        return f"Run({self.name!r}: {rows}{', failed' if self.failure else ''})"

    def __getitem__(self, port: str) -> np.ndarray:
        """Return one signal by its "block.port"."""
        if port not in self.columns:
            raise ParameterError(
                f"no signal '{port}' in this run; signals: {listing(self.columns)}"
                f"{suggest(port, self.columns)}"
            )
        return self.values[:, self.columns.index(port)]

    @cached_property
    def frame(self) -> "pd.DataFrame":
        """The signals as a pandas DataFrame; the index is the time in s."""
        import pandas as pd

        index = pd.Index(self.time, name="time")
        return pd.DataFrame(self.values, index=index, columns=list(self.columns))

    def save(self, path: str | Path) -> Path:
        """Write to .parquet (units and the rest in the schema's metadata) or .csv; return the path.

        In CSV the first line holds the names and numbers are written so that they read back to
        the same bits; the units do not go in.
        """
        path = check_target(path)
        try:
            if path.suffix == ".csv":
                self.frame.to_csv(path)
            else:
                self._save_parquet(path)
        except OSError as error:
            raise FileError(f"cannot write {path}: {error.strerror or error}") from error
        return path

    def _save_parquet(self, path: Path) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        meta = {
            "name": self.name,
            "units": dict(self.units),
            "failure": self.failure,
        }
        arrays = {"time": self.time} | {c: self[c] for c in self.columns}
        fields = [
            pa.field(n, pa.float64(), metadata={"unit": {"time": "s", **self.units}.get(n, "")})
            for n in arrays
        ]
        schema = pa.schema(fields, metadata={_META: json.dumps(meta).encode()})
        pq.write_table(pa.table(arrays, schema=schema), path, compression="zstd")

    @classmethod
    def load(cls, path: str | Path) -> "Run":
        """Read a run that `save` wrote as Parquet."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        path = Path(path)
        if not path.is_file():
            raise FileError(f"no file {path}")
        try:
            table = pq.read_table(path)
        except (OSError, pa.ArrowInvalid) as error:
            raise FileError(f"cannot read {path} as Parquet: {error}") from error
        meta = json.loads((table.schema.metadata or {}).get(_META, b"null"))
        if meta is None:
            raise FileError(f"{path} was not written by railcosim")
        columns = tuple(name for name in table.column_names if name != "time")
        signals = [table[name].to_numpy() for name in columns]
        values = np.column_stack(signals) if signals else np.empty((table.num_rows, 0))
        return cls(
            meta["name"],
            table["time"].to_numpy(),
            values,
            columns,
            meta["units"],
            meta["failure"],
        )

    def scope(self, *ports: str) -> "Figure":
        """Return a figure of these signals (default: all) over time, one axis for each unit."""
        from .scope import scope

        return scope(self, ports or self.columns)
