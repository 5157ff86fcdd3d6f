"""What a campaign does in each run: any function of the numbers drawn and a generator."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ...base.errors import ParameterError
from ..results.result import Run

Drawn = Mapping[str, Any]  # the numbers of one run by name; "block.parameter" for a diagram's
Value = float | int | bool | str | None
Rows = Mapping[str, Value] | Sequence[Mapping[str, Value]]  # one row of metrics, or several

RESERVED = ("run", "seed", "error")  # columns that every table has


class Work(Protocol):
    """One run. The generator is the run's own, for what is random beside the numbers drawn."""

    def __call__(self, drawn: Drawn, generator: np.random.Generator, /) -> Rows:
        """Return the run's row or rows."""
        ...


@runtime_checkable
class Simulation(Protocol):
    """Work that consists of a simulation and its measurement: its signals can be kept."""

    def run(self, drawn: Drawn, generator: np.random.Generator) -> Run:
        """Return the run's signals."""
        ...

    def measured(self, run: Run) -> Rows:
        """Return the run's row or rows."""
        ...


@runtime_checkable
class Preparable(Protocol):
    """Work that is quicker when it keeps something from run to run."""

    def prepared(self) -> Any:
        """Return the work as it is to be called in one thread, run after run."""
        ...


@runtime_checkable
class Closable(Protocol):
    """Prepared work that holds something."""

    def close(self) -> None:
        """Free it."""
        ...


def plain_rows(found: Any, taken: Mapping[str, Any]) -> list[dict[str, Value]]:
    """Return rows in Python's own types; raise ParameterError for what no table can hold."""
    rows = [found] if isinstance(found, Mapping) else found
    if not isinstance(rows, Sequence) or isinstance(rows, str):
        raise ParameterError(f"a run gives a row (a mapping) or a list of rows, not {found!r}")
    made = []
    for row in rows:
        if not isinstance(row, Mapping):
            raise ParameterError(f"a row is a mapping of metrics, not {row!r}")
        for name in row:
            if name in taken or name in RESERVED:
                raise ParameterError(f"metric '{name}' bears the name of another column")
        made.append(plain_row(row))
    return made


def plain_row(row: Mapping[str, Any]) -> dict[str, Value]:
    """Return a row in Python's own types; raise ParameterError for what no table can hold."""
    return {str(name): _plain(name, value) for name, value in row.items()}


def _plain(name: str, value: Any) -> Value:
    if isinstance(value, np.generic) or (isinstance(value, np.ndarray) and value.ndim == 0):
        value = value.item()
    if isinstance(value, str):
        return plain_text(value)
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        return float(value)
    if value is None or isinstance(value, float | int):
        return value
    raise ParameterError(f"'{name}' is {value!r}, which is no number, truth value, text or None")


def plain_text(text: str) -> str:
    """Return a text that any file can hold."""
    return text.encode("utf-8", "replace").decode()
