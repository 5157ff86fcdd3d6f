"""CSV files of signals over time: a column `time` (s), then variables by name."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..base.errors import FileError, listing, suggest

if TYPE_CHECKING:
    import pandas as pd


def read_table(path: str | Path, known: Iterable[str], what: str) -> "pd.DataFrame":
    """Return the file's columns with the time as index.

    Every column must be one of `known` (`what` says what those are). Raise FileError for a file
    that cannot be read, times that decrease, a value that is no finite number, or an unknown
    column.
    """
    import pandas as pd

    path = Path(path)
    try:
        table = pd.read_csv(path, skipinitialspace=True)
    except FileNotFoundError:
        raise FileError(f"no file {path}") from None
    except (OSError, ValueError) as error:  # pandas' parser errors are ValueErrors
        words = str(error).partition("\n")[0]
        raise FileError(f"cannot read {path} as CSV: {words}") from error
    table.columns = [str(name).strip().strip('"') for name in table.columns]
    if len(table.columns) == 0 or table.columns[0] != "time":
        raise FileError(f"{path}: the first column must be 'time' (s), then variables by name")
    known = list(known)
    for name in table.columns[1:]:
        if name not in known:
            raise FileError(
                f"{path}: no {what} '{name}'; there are: {listing(known)}{suggest(name, known)}"
            )
        if table.columns.tolist().count(name) > 1:
            raise FileError(f"{path}: two columns are named '{name}'")
    if len(table) == 0:
        raise FileError(f"{path} holds no rows")
    for name in table.columns:
        numbers = pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=float)
        bad = np.nonzero(~np.isfinite(numbers))[0]
        if len(bad):
            value = table[name].iloc[int(bad[0])]
            raise FileError(
                f"{path}, line {int(bad[0]) + 2}, column '{name}': {value!r} is not a finite number"
            )
        table[name] = numbers
    falling = np.nonzero(np.diff(table["time"].to_numpy()) < 0.0)[0]
    if len(falling):
        raise FileError(f"{path}, line {int(falling[0]) + 3}: the time decreases")
    return table.set_index("time")


def sample(table: "pd.DataFrame", times: np.ndarray) -> Mapping[str, np.ndarray]:
    """Return each column at these times: straight lines between rows, a repeated time is a jump.

    At a jump the later row holds; before the first and after the last row its value is held.
    """
    from ..cosim import Profile

    found = {}
    for name in table.columns:
        pairs = zip(table.index.tolist(), table[name].tolist(), strict=True)
        profile = Profile(tuple(pairs))
        found[name] = np.array([profile.output((), t) for t in times.tolist()])
    return found
