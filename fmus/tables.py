"""CSV files of signals over time: a column `time` (s), then variables by name."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..base.errors import FileError, listing, suggest
from ..cosim import Profile


@dataclass(frozen=True)
class Table:
    """Signals by name at common times (s); a time that stands twice is a jump."""

    times: np.ndarray
    columns: dict[str, np.ndarray]

    def points(self, name: str) -> tuple[tuple[float, float], ...]:
        """Return one column as (time, value) pairs."""
        return tuple(zip(self.times.tolist(), self.columns[name].tolist(), strict=True))

    def sample(self, names: Iterable[str], times: np.ndarray) -> dict[str, np.ndarray]:
        """Return columns at these times: straight lines between rows, the later row at a jump.

        Before the first and after the last row its value is held.
        """
        found = {}
        for name in names:
            profile = Profile(self.points(name))
            found[name] = np.array([profile.output((), t) for t in times.tolist()])
        return found


def read_table(path: str | Path, known: Iterable[str], what: str) -> Table:
    """Return a CSV file's signals.

    Every column after `time` must be one of `known` (`what` says what those are). Raise FileError
    for a file that cannot be read, times that decrease, a value that is no finite number, or an
    unknown or doubled column.
    """
    path = Path(path)
    heads, cells = _cells(path)
    if not heads or heads[0] != "time":
        raise FileError(
            f"{path}: the first column must be 'time' (s), not '{heads[0] if heads else ''}'; "
            "columns are separated by commas"
        )
    known = list(known)
    for name in heads[1:]:
        if name not in known:
            raise FileError(
                f"{path}: no {what} '{name}'; there are: {listing(known)}{suggest(name, known)}"
            )
        if heads.count(name) > 1:
            raise FileError(f"{path}: two columns are named '{name}'")
    if len(cells) == 0:
        raise FileError(f"{path} holds no rows")
    columns = {name: _numbers(path, name, cells[:, i]) for i, name in enumerate(heads)}
    times = columns.pop("time")
    falling = np.nonzero(np.diff(times) < 0.0)[0]
    if len(falling):
        raise FileError(f"{path}, line {int(falling[0]) + 3}: the time decreases")
    return Table(times, columns)


def _cells(path: Path) -> tuple[list[str], Any]:
    import pandas as pd

    try:
        table = pd.read_csv(
            path, skipinitialspace=True, header=None, dtype=str, keep_default_na=False
        )
    except FileNotFoundError:
        raise FileError(f"no file {path}") from None
    except pd.errors.EmptyDataError:
        raise FileError(f"{path} is empty") from None
    except OSError as error:
        raise FileError(f"cannot read {path}: {error.strerror or error}") from error
    except pd.errors.ParserError as error:
        words = str(error).strip().rpartition("error: ")[2]
        raise FileError(f"{path}: the rows differ in their number of cells: {words}") from error
    except ValueError as error:
        raise FileError(f"{path} is no text file with commas: {error}") from error
    cells = table.to_numpy(dtype=object)
    return [str(cell).strip().strip('"') for cell in cells[0]], cells[1:]


def _numbers(path: Path, name: str, cells: Any) -> np.ndarray:
    numbers = np.empty(len(cells))
    for i, cell in enumerate(cells):
        try:
            numbers[i] = float(cell)
        except ValueError:
            numbers[i] = np.nan
        if not np.isfinite(numbers[i]):
            shown = f"'{cell}'" if cell else "an empty cell"
            raise FileError(
                f"{path}, line {i + 2}, column '{name}': {shown} is not a finite number"
            )
    return numbers
