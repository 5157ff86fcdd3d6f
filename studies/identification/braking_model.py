"""The two braking models, run over logs: speeds, errors and their derivatives."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from casadi import DM

from .braking import Braking
from .delayed import HeldCommands
from .equations import Equations, over_steps
from .parameters import CONSTANTS, Parameter

STEP = 0.1  # s, the longest step
CENTIMETRES = 100.0  # for 1 m

Values = Mapping[str, np.ndarray]  # parameter's name -> its value in each braking


class BrakingModel(ABC):
    """A model that runs freely over each braking: from its first speed, by the command alone.

    `free` are the parameters to be identified, in the order of every vector and column here;
    `held` are those that were given by name, `constants` all that are taken as known.
    """

    name: str
    equations: Equations
    candidates: tuple[Parameter, ...]

    def __init__(
        self,
        brakings: Sequence[Braking],
        *,
        fixed: Mapping[str, float] | None = None,
        step: float = STEP,
    ) -> None:
        self.brakings = tuple(brakings)
        self.held = dict(fixed or {})
        self.constants = {**CONSTANTS, **self.held}
        self.free = tuple(p for p in self.candidates if p.name not in (fixed or {}))
        points, self._ends = zip(*(_grid(b.time, step) for b in brakings), strict=True)
        most = max(map(len, points))
        # Logs that are shorter end in steps of no width.
        padded = np.array([np.pad(p, (0, most - len(p)), mode="edge") for p in points])
        self._start, self._width = padded[:, :-1], np.diff(padded)
        self._gradient = np.array(
            [np.interp(m, b.time, b.gradient)
             for b, m in zip(brakings, self._start + 0.5 * self._width, strict=True)]
        )  # fmt: skip
        # Where the samples that count lie among the grid's points, log by log
        self._samples = [e[b.counts] for b, e in zip(brakings, self._ends, strict=True)]
        self._commands = HeldCommands(
            [b.command_time for b in brakings], [b.command for b in brakings]
        )
        at_first = np.zeros((len(points), 1))
        self.first_command = self._commands.delayed(at_first[:, 0], at_first, at_first).mean[:, 0]
        self.measured = np.concatenate([b.speed[b.counts] for b in brakings])
        self.log_of_sample = np.repeat(np.arange(len(brakings)), [len(s) for s in self._samples])

    @property
    def start(self) -> np.ndarray:
        """Where a search begins."""
        return np.array([p.start for p in self.free])

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the free parameters."""
        return np.array([p.low for p in self.free]), np.array([p.high for p in self.free])

    def size(self, free: np.ndarray) -> np.ndarray:
        """Return what a parameter's changes are measured by: its value, or 5 % of its range."""
        low, high = self.bounds
        return np.maximum(np.abs(free), 0.05 * (high - low))

    def values(self, free: np.ndarray) -> Values:
        """Return all parameters by name, each a number for every braking.

        `free` is a vector of the free ones, or one row for each braking.
        """
        rows = np.broadcast_to(np.asarray(free, dtype=float), (len(self.brakings), len(self.free)))
        known = {name: np.full(len(rows), value) for name, value in self.constants.items()}
        return known | {p.name: rows[:, i] for i, p in enumerate(self.free)}

    def speeds(self, free: np.ndarray) -> np.ndarray:
        """Return the model's speeds (m/s) at the samples that count, log after log.

        `free` here and below is a vector of the free parameters, or one row for each braking.
        """
        return np.maximum(self._at_samples(self._run(self.values(free)))[:, 0], 0.0)

    def errors(self, free: np.ndarray) -> np.ndarray:
        """Return model minus measured speed (m/s) at the samples that count."""
        return self.speeds(free) - self.measured

    def errors_and_jacobian(self, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the errors and their derivatives by the free parameters, (sample, parameter)."""
        values = self.values(free)
        speed, named = self.sensitivities(values)
        columns = [self._column(p.name, named, values) for p in self.free]
        return speed - self.measured, np.column_stack(columns)

    def sensitivities(self, values: Values) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Return the speeds and their derivatives by each of the equations' directions."""
        speed = self._at_samples(self._run(values, tangents=True))
        # A train that stands does so whatever the parameters.
        changes = np.where(speed[:, :1] > 0.0, speed[:, 1:], 0.0)
        named = dict(zip(self.equations.directions, changes.T, strict=True))
        return np.maximum(speed[:, 0], 0.0), named

    def rmse(self, free: np.ndarray) -> float:
        """Return the root mean square of the error in cm/s (the precise braking paper, eq. 12)."""
        return CENTIMETRES * float(np.sqrt(np.mean(self.errors(free) ** 2)))

    def rmse_by_log(self, free: np.ndarray) -> np.ndarray:
        """Return that of each braking."""
        squares = self.errors(free) ** 2
        means = np.bincount(self.log_of_sample, squares) / np.bincount(self.log_of_sample)
        return CENTIMETRES * np.sqrt(means)

    def trajectory(self, free: np.ndarray, log: int) -> np.ndarray:
        """Return one braking's speeds (m/s) at all its samples, those that lead up included."""
        states = self._run(self.values(free))[log]
        return np.maximum(states[self._ends[log], 0], 0.0)

    # What differs between the models

    @abstractmethod
    def _signals(self, values: Values) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Return the equations' signals and their changes, arrays (log, step)."""

    @abstractmethod
    def _initial(self, values: Values) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Return the brake's state at the start (log), and how it changes with parameters.

        It is in balance with the command.
        """

    def _column(self, name: str, named: Mapping[str, np.ndarray], values: Values) -> np.ndarray:
        """Return the derivative of the speeds by a parameter."""
        return named[name]

    # Running

    @cached_property
    def _mapped(self) -> tuple[Any, Any]:
        """The equations over all steps of all logs, without and with sensitivities."""
        logs, steps = self._start.shape
        both = (self.equations.advance, self.equations.advance_with)
        plain, grown = (over_steps(f, steps).map(logs) for f in both)
        return plain, grown

    def _run(self, values: Values, *, tangents: bool = False) -> np.ndarray:
        """Return the speed's state at all grid points, (log, point, 1); below 0 after a stop.

        With `tangents` the derivatives by the directions follow in the last axis.
        """
        logs, steps = self._start.shape
        signals, changes = self._signals(values)
        z = np.stack([*signals, self._gradient, self._width]).reshape(len(signals) + 2, -1)
        constants = np.array([values[name] for name in self.equations.parameters])
        directions = self.equations.directions if tangents else ()
        brake, by_parameter = self._initial(values)
        begin = np.zeros((len(self.equations.states), logs, 1 + len(directions)))
        begin[0, :, 0] = [b.start_speed for b in self.brakings]
        begin[1, :, 0] = brake
        for name, change in by_parameter.items():
            if name in directions:
                begin[1, :, 1 + directions.index(name)] = change
        flat = begin.reshape(len(begin), -1)
        if tangents:
            moving = np.stack(changes).reshape(len(changes), -1)
            found = self._mapped[1](flat, DM(z), DM(moving), constants)
        else:
            found = self._mapped[0](flat, DM(z), constants)  # a DM goes in four times as quickly
        after = found.full().reshape(logs, steps, -1)
        return np.concatenate((begin[0][:, None], after), axis=1)

    def _at_samples(self, states: np.ndarray) -> np.ndarray:
        return np.concatenate([states[i, at] for i, at in enumerate(self._samples)])


def _grid(samples: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points not further apart than a step, and where among them the samples are."""
    parts = np.maximum(np.ceil(np.diff(samples) / step - 1e-9), 1.0).astype(int)
    ends = np.concatenate(([0], np.cumsum(parts)))
    return np.interp(np.arange(ends[-1] + 1), ends, samples), ends
