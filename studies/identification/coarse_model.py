"""The coarse braking model over logs: one lag for everything."""

from functools import cached_property

import numpy as np

from .braking_model import BrakingModel, Values
from .equations import Equations, coarse_equations
from .parameters import COARSE


class CoarseModel(BrakingModel):
    """`coarse_metro_train` over logs: it knows no changeover and no flag."""

    name = "coarse"
    candidates = COARSE

    @cached_property
    def equations(self) -> Equations:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The plant's equations."""
        return coarse_equations()

    def _signals(self, values: Values) -> tuple[list[np.ndarray], list[np.ndarray]]:
        command = self._commands.delayed(values["delay"], self._start, self._width)
        return [command.mean, command.tilt], [command.mean_change, command.tilt_change]

    def _initial(self, values: Values) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        effort = self.first_command / values["mass_ratio"]
        return effort, {"mass_ratio": -effort / values["mass_ratio"]}
