"""Inputs for a check: from a file, or seeded random values within the inputs' bounds."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...cosim.clock import Clock
from ...cosim.fmu.file import number_of, start_of
from ..simulate import Span
from ..tables import Table
from .subject import Subject

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

    @property
    def step(self) -> float:
        """The communication step in s."""
        return float(self.times[1] - self.times[0])

    def row(self, k: int, names: list[str]) -> list[float]:
        """Return the inputs held from point k on."""
        return [float(self.inputs[name][k]) for name in names]

    def first(self, steps: int) -> "Excitation":
        """Return the first steps of this excitation."""
        held = {name: values[: steps + 1] for name, values in self.inputs.items()}
        return replace(self, times=self.times[: steps + 1], inputs=held)

    def held(self) -> "Excitation":
        """Return the excitation with inputs that change only every ten steps."""
        held = {n: np.repeat(v[::COARSE], COARSE)[: len(v)] for n, v in self.inputs.items()}
        return replace(self, inputs=held)

    def changes(self) -> list[int]:
        """Return the points at which an input takes another value."""
        moved = np.zeros(len(self.times), dtype=bool)
        for values in self.inputs.values():
            moved[1:] |= values[1:] != values[:-1]
        return np.flatnonzero(moved).tolist()


def grid(times: Span) -> np.ndarray:
    """Return the communication points from start to stop."""
    return np.array(Clock(times.step, times.start).times(times.count + 1))


def from_table(table: Table, text: str, subject: Subject, times: np.ndarray) -> Excitation:
    """Return the table's inputs at these times; inputs without a column keep their start value."""
    columns = [name for name in table.columns if name in subject.inputs]
    found = table.sample(columns, times)
    for name in subject.inputs:
        found.setdefault(name, np.full(len(times), start(subject.variables[name])))
    return Excitation(times, found, f"inputs from {text}" if columns else "inputs at their start")


def seeded(subject: Subject, times: np.ndarray) -> Excitation:
    """Return random inputs, constant for ten communication steps each."""
    generator = np.random.default_rng(SEED)
    draws = -(-len(times) // COARSE)
    found = {}
    for name in subject.inputs:
        values = draw(subject.variables[name], draws, generator)
        found[name] = np.repeat(values, COARSE)[: len(times)]
    text = f"random inputs within their bounds, held (seed {SEED})" if found else "no inputs"
    return Excitation(times, found, text)


def draw(variable: Any, count: int, generator: np.random.Generator) -> np.ndarray:
    """Return random values of an input within its bounds."""
    low, high = bounds(variable)
    if variable.type == "Real":
        return generator.uniform(low, high, count)
    return generator.integers(int(low), int(high), count, endpoint=True).astype(float)


def start(variable: Any) -> float:
    """Return a number variable's start value, 0 if there is none."""
    return float(start_of(variable) or 0.0)


def bounds(variable: Any) -> tuple[float, float]:
    """Return the declared bounds; where one is missing, start ± the nominal value (or 1)."""
    if variable.type == "Boolean":
        return 0.0, 1.0
    middle, size = start(variable), number_of(variable, "nominal") or 1.0
    low, high = number_of(variable, "min"), number_of(variable, "max")
    low = middle - size if low is None else low
    high = middle + size if high is None else high
    return (low, high) if low <= high else (high, low)
