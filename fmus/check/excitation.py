"""Inputs for a check: from a file, or seeded random values within the inputs' bounds."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...cosim import Fmu
from ...cosim.clock import Clock
from ...cosim.fmu_file import number_of, start_of
from ..simulate import Span
from ..tables import Table

SEED = 1
COARSE = 10  # the coarse communication step, in fine ones: inputs change only there


@dataclass(frozen=True)
class Excitation:
    """Communication points (s) and the inputs held from each to the next."""

    times: np.ndarray
    inputs: Mapping[str, np.ndarray]
    text: str

    @property
    def span_text(self) -> str:
        """How many steps to which time."""
        return f"{len(self.times) - 1} steps to {self.times[-1]:g} s"

    def row(self, k: int, names: list[str]) -> list[float]:
        """Return the inputs held from point k on."""
        return [float(self.inputs[name][k]) for name in names]


def grid(times: Span) -> np.ndarray:
    """Return the communication points from start to stop."""
    return np.array(Clock(times.step, times.start).times(times.count + 1))


def from_table(
    table: Table, text: str, block: Fmu, description: Any, times: np.ndarray
) -> Excitation:
    """Return the table's inputs at these times; inputs without a column keep their start value."""
    columns = [name for name in table.columns if name in block.inputs]
    found = table.sample(columns, times)
    for variable in _inputs(block, description):
        found.setdefault(variable.name, np.full(len(times), _start(variable)))
    return Excitation(times, found, f"inputs from {text}" if columns else "inputs at their start")


def seeded(block: Fmu, description: Any, times: np.ndarray) -> Excitation:
    """Return random inputs, constant for ten communication steps each."""
    generator = np.random.default_rng(SEED)
    draws = -(-len(times) // COARSE)
    found = {}
    for variable in _inputs(block, description):
        low, high = _bounds(variable)
        if variable.type == "Real":
            values = generator.uniform(low, high, draws)
        else:
            values = generator.integers(int(low), int(high), draws, endpoint=True).astype(float)
        found[variable.name] = np.repeat(values, COARSE)[: len(times)]
    text = f"random inputs within their bounds, held (seed {SEED})" if found else "no inputs"
    return Excitation(times, found, text)


def _inputs(block: Fmu, description: Any) -> list[Any]:
    return [v for v in description.modelVariables if v.name in block.inputs]


def _start(variable: Any) -> float:
    return float(start_of(variable) or 0.0)


def _bounds(variable: Any) -> tuple[float, float]:
    """Return the declared bounds; where one is missing, start ± the nominal value (or 1)."""
    if variable.type == "Boolean":
        return 0.0, 1.0
    start, size = _start(variable), number_of(variable, "nominal") or 1.0
    low, high = number_of(variable, "min"), number_of(variable, "max")
    low = start - size if low is None else low
    high = start + size if high is None else high
    return (low, high) if low <= high else (high, low)
