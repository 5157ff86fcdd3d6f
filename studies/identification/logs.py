"""Logs of train runs from CSV and Parquet files, checked."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.errors import FileError
from .columns import COLUMNS, find_columns

if TYPE_CHECKING:
    import pandas as pd

FASTEST = 50.0  # m/s, no metro train goes at 180 km/h: beyond, the unit must be wrong
STRONGEST = 5.0  # m/s²
LARGEST_GAP = 2.0  # s between samples; longer, and a command would be unknown for too long
FEWEST = 10  # samples in a run


@dataclass(frozen=True, kw_only=True, eq=False)
class Log:
    """One run of a train.

    `time` in s, rising; `command` in m/s², negative brakes, held from each sample to the next;
    `speed` in m/s; `air_brake` whether the air brake is on; `gradient` in ‰, uphill positive,
    the mean under the train. `air_brake` and `gradient` may be missing. Samples need not be
    evenly spaced.
    """

    name: str
    time: np.ndarray
    command: np.ndarray
    speed: np.ndarray
    air_brake: np.ndarray | None = None
    gradient: np.ndarray | None = None


def read_logs(paths: Iterable[str | Path]) -> list[Log]:
    """Return the runs in some CSV (.csv) and Parquet (.parquet) files; a folder means all in it.

    Columns: `time`, `command`, `speed`, and optionally `air_brake` (0/1), `gradient` and `run`
    (a number or name: several runs in one file, one after the other). A unit may follow in
    brackets, as in `speed [km/h]`; without one they are s, m/s², m/s and ‰. Other columns are
    ignored. Raise FileError, naming file, row, column and remedy.
    """
    files = [file for path in paths for file in _files(Path(path))]
    if not files:
        raise FileError("no logs given; name CSV or Parquet files")
    real = [file.resolve() for file in files]
    twice = next((file for i, file in enumerate(files) if real[i] in real[:i]), None)
    if twice is not None:
        raise FileError(f"{twice} is given twice; a log counts once, name it once")
    return [log for file in files for log in _runs(file)]


def _files(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = sorted(f for f in path.iterdir() if f.suffix.lower() in (".csv", ".parquet"))
    if not found:
        raise FileError(f"{path} has no .csv or .parquet files")
    return found


def _runs(path: Path) -> list[Log]:
    table = _table(path)
    if len(table) == 0:
        raise FileError(f"{path} has no rows")
    columns = find_columns(str(path), [str(name) for name in table.columns])
    data = {
        name: _numbers(path, table[spelled], spelled) * factor
        for name, (spelled, factor) in columns.items()
        if name != "run"
    }
    for name, (spelled, _) in columns.items():
        if name != "run":
            _check(path, name, spelled, data[name])
    if "run" not in columns:
        return [_log(path, path.stem, data, np.arange(len(table)))]
    runs: Any = table[columns["run"][0]]
    if runs.isna().any():
        at = int(np.flatnonzero(runs.isna())[0])
        raise FileError(f"{path}, {_row(path, at)}: no value in column '{columns['run'][0]}'")
    changes = np.flatnonzero(runs.to_numpy()[1:] != runs.to_numpy()[:-1]) + 1
    parts = np.split(np.arange(len(table)), changes)
    names = [f"{path.stem}-{runs.iloc[part[0]]}" for part in parts]
    twice = next((n for i, n in enumerate(names) if n in names[:i]), None)
    if twice is not None:
        at = int(parts[len(names) - 1 - names[::-1].index(twice)][0])
        run = runs.iloc[at]
        raise FileError(f"{path}, {_row(path, at)}: run {run} begins again; sort the rows by run")
    return [_log(path, name, data, part) for name, part in zip(names, parts, strict=True)]


def _table(path: Path) -> "pd.DataFrame":
    """Return a file's table, with texts as they stand."""
    import pandas as pd

    if not path.is_file():
        raise FileError(f"no file {path}")
    suffix = path.suffix.lower()
    try:
        if suffix == ".parquet":
            table = pd.read_parquet(path)
            indexed = table.index.name is not None
            return table.reset_index() if indexed else table.reset_index(drop=True)
        if suffix == ".csv":
            return pd.read_csv(path, sep=_separator(path), skipinitialspace=True, index_col=False)
    except Exception as error:  # whatever pandas and pyarrow find wrong with it
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FileError(f"cannot read {path}: {reason}") from error
    raise FileError(f"{path}: logs are .csv or .parquet files, not '{suffix or 'without ending'}'")


def _separator(path: Path) -> str:
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        head = file.readline()
    return ";" if ";" in head and "," not in head else ","


def _row(path: Path, index: int) -> str:
    """Return where a row stands, as an editor or pandas counts."""
    return f"line {index + 2}" if path.suffix.lower() == ".csv" else f"row {index}"


def _numbers(path: Path, column: Any, name: str) -> np.ndarray:
    import pandas as pd

    words = {"true": 1.0, "false": 0.0, "on": 1.0, "off": 0.0}
    plain = column.map(lambda v: words.get(v.strip().lower(), v) if isinstance(v, str) else v)
    values = np.asarray(pd.to_numeric(plain, errors="coerce"), dtype=float)
    wrong = np.flatnonzero(~np.isfinite(values))
    if len(wrong):
        at = int(wrong[0])
        more = f" ({len(wrong)} such rows)" if len(wrong) > 1 else ""
        raise FileError(
            f"{path}, {_row(path, at)}, column '{name}': {str(column.iloc[at])!r} is not a finite "
            f"number{more}; complete the row or remove it"
        )
    return values


def _check(path: Path, name: str, spelled: str, values: np.ndarray) -> None:
    """Refuse what no train does: mostly a unit that was not said."""
    low, high, remedy = {
        "speed": (-1.0, FASTEST, "say the unit, as in 'speed [km/h]' or 'speed [cm/s]'"),
        "command": (-STRONGEST, STRONGEST, "say the unit, as in 'command [cm/s2]'"),
        "gradient": (-200.0, 200.0, "gradients are in ‰, uphill positive"),
        "air_brake": (0.0, 1.0, "the flag is 0 (off) or 1 (on)"),
    }.get(name, (-np.inf, np.inf, ""))
    out = (values < low) | (values > high)
    if name == "air_brake":
        out |= (values != 0.0) & (values != 1.0)
    wrong = np.flatnonzero(out)
    if len(wrong):
        unit = COLUMNS[name].unit
        raise FileError(
            f"{path}, {_row(path, int(wrong[0]))}, column '{spelled}': {values[wrong[0]]:g} "
            f"{unit if unit != '1' else ''} cannot be; {remedy}".replace("  ", " ")
        )


def _log(path: Path, name: str, data: dict[str, np.ndarray], rows: np.ndarray) -> Log:
    part = {column: values[rows] for column, values in data.items()}
    time = part["time"]
    if len(time) < FEWEST:
        raise FileError(f"{path}, run '{name}': {len(time)} samples are too few; {FEWEST} at least")
    steps = np.diff(time)
    wrong = np.flatnonzero(steps <= 0.0)
    if len(wrong):
        at = int(wrong[0]) + 1
        raise FileError(
            f"{path}, {_row(path, int(rows[at]))}, column 'time': {time[at]:g} s follows "
            f"{time[at - 1]:g} s; sort the rows by time and remove doubled ones (several runs in "
            "a file need a column 'run')"
        )
    wide = np.flatnonzero(steps > LARGEST_GAP)
    if len(wide):
        at = int(wide[0]) + 1
        raise FileError(
            f"{path}, {_row(path, int(rows[at]))}, column 'time': a gap of {steps[at - 1]:g} s; "
            f"samples may be unevenly spaced, but not by more than {LARGEST_GAP:g}"
            " s; split the run there"
        )
    flag = part.get("air_brake")
    return Log(
        name=name, time=time, command=part["command"], speed=part["speed"],
        air_brake=None if flag is None else flag > 0.5, gradient=part.get("gradient"),
    )  # fmt: skip
