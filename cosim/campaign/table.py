"""The final table: the same bytes for the same campaign, however it was computed."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import CampaignError
from .files import write_whole
from .journal import Record

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

NAME = "table.parquet"
_ROWS = 1 << 16  # of a row group
_META = b"railcosim"


def make_table(
    records: Iterable[Record],
    *,
    seed: int,
    units: Mapping[str, str],
    meta: Mapping[str, Any],
    names: Sequence[str] = (),
) -> "pa.Table":
    """Return the runs' rows in order: run, seed, the numbers drawn, the metrics, error.

    `names` are the numbers drawn as far as they are known; those that turn up come after them. A
    run without rows, one that failed above all, has one, without metrics.
    """
    import pyarrow as pa

    runs: list[int] = []
    errors: list[str | None] = []
    drawn: dict[str, list[Any]] = {name: [] for name in names}
    metrics: dict[str, list[Any]] = {}
    for record in records:
        for row in record["rows"] or [{}]:
            _append(drawn, record["drawn"], len(runs))
            _append(metrics, row, len(runs))
            runs.append(record["run"])
            errors.append(record["error"])
    both = [name for name in metrics if name in drawn]
    if both:
        raise CampaignError(f"'{both[0]}' is drawn in some runs and a metric of others")
    columns = {**drawn, **metrics}
    for values in columns.values():
        values.extend([None] * (len(runs) - len(values)))
    arrays = [pa.array(runs, pa.int64()), pa.array([f"[{seed}, {run}]" for run in runs])]
    arrays += [_array(values) for values in columns.values()]
    arrays.append(pa.array(errors, pa.string()))
    fields = [
        pa.field(name, array.type, metadata={"unit": units.get(name, "1" if name == "run" else "")})
        for name, array in zip(["run", "seed", *columns, "error"], arrays, strict=True)
    ]
    text = json.dumps(dict(meta), sort_keys=True)
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata={_META: text}))


def _append(columns: dict[str, list[Any]], row: Mapping[str, Any], length: int) -> None:
    """Add a row; columns it lacks are filled up when they are next met, or at the end."""
    for name, value in row.items():
        values = columns.setdefault(name, [])
        values.extend([None] * (length - len(values)))
        values.append(value)


def _array(values: list[Any]) -> "pa.Array":
    """Return a column in the one type that fits all its values."""
    import pyarrow as pa

    kinds = {type(value) for value in values} - {type(None)}
    if str in kinds:
        texts = [v if v is None or isinstance(v, str) else json.dumps(v) for v in values]
        return pa.array(texts, pa.string())
    if kinds == {bool}:
        return pa.array(values, pa.bool_())
    if kinds == {int}:
        return pa.array(values, pa.int64())
    return pa.array([None if v is None else float(v) for v in values], pa.float64())


def write_table(path: Path, table: "pa.Table") -> None:
    """Write the table, whole or not at all."""
    import pyarrow.parquet as pq

    def write(stream: Any) -> None:
        pq.write_table(
            table, stream, row_group_size=_ROWS, compression="zstd", use_dictionary=False
        )

    write_whole(path, write)


def frame_of(table: "pa.Table") -> "pd.DataFrame":
    """Return the table for pandas; `attrs["units"]` holds the columns' units."""
    frame = table.to_pandas()
    frame.attrs["units"] = {f.name: f.metadata[b"unit"].decode() for f in table.schema}
    return frame
