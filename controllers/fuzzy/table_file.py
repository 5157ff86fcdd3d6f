"""A query table as a CSV file."""

import csv
from pathlib import Path

from ...base.errors import ParameterError
from .levels import Levels
from .relation import Table


def write_table(path: str | Path, table: Table, rows: Levels, columns: Levels) -> Path:
    """Write a query table as CSV and return its path.

    The first row has the columns' levels by name, the first column the rows' ("-0", "+0" …). The
    numbers are those of the table to the last bit. Raise ParameterError if the sizes differ.
    """
    if len(table) != len(rows.names) or any(len(r) != len(columns.names) for r in table):
        raise ParameterError(
            f"the table must have {len(rows.names)} rows of {len(columns.names)} numbers"
        )
    path = Path(path)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["", *columns.names])
        for name, row in zip(rows.names, table, strict=True):
            writer.writerow([name, *(repr(float(number)) for number in row)])
    return path
