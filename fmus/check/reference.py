"""References for an FMU's run: a file, or the equations that it carries."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...base.errors import FileError
from ..tables import Table, read_table
from .report import Comparison
from .stepping import signal_size
from .subject import Subject


def compare(
    outputs: Mapping[str, str | None],
    times: np.ndarray,
    found: np.ndarray,
    expected: dict[str, np.ndarray],
    tolerance: float,
) -> list[Comparison]:
    """Return one comparison for each output (name -> unit) that the reference has.

    The allowed error is `tolerance` times the reference's largest magnitude (at least 1e-6).
    """
    rows = []
    for i, (name, unit) in enumerate(outputs.items()):
        if name not in expected:
            continue
        error = np.abs(found[:, i] - expected[name])
        at = int(np.argmax(np.where(np.isnan(error), np.inf, error)))
        allowed = tolerance * signal_size(expected[name])
        rows.append(Comparison(name, unit or "", float(error[at]), float(times[at]), allowed))
    return rows


def read_reference(file: str | Path, subject: Subject) -> Table:
    """Return the file's table; its columns are outputs of the FMU, or inputs to apply."""
    table = read_table(file, [*subject.outputs, *subject.inputs], "output or input")
    if not set(subject.outputs) & set(table.columns):
        raise FileError(f"{file} has no output of the FMU to compare with")
    return table
