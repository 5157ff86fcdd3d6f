"""The precise braking model over logs: electric brake, changeover, air brake."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from .braking import Braking
from .braking_model import STEP, BrakingModel, Values
from .equations import K1K2, Equations, precise_equations
from .parameters import CHANGEOVER, DENOMINATOR, PRECISE


class PreciseModel(BrakingModel):
    """`metro_train` over logs.

    The air brake comes on where the log's flag says so. Without a flag it does so T3 after the
    measured speed has passed the changeover speed V_sw, which then is identified too.
    """

    name = "precise"
    candidates = (*PRECISE, CHANGEOVER)

    def __init__(
        self,
        brakings: Sequence[Braking],
        *,
        fixed: Mapping[str, float] | None = None,
        step: float = STEP,
    ) -> None:
        super().__init__(brakings, fixed=fixed, step=step)
        self.flagged = all(b.onset is not None for b in brakings)
        if self.flagged:
            self.free = tuple(p for p in self.free if p is not CHANGEOVER)

    @cached_property
    def equations(self) -> Equations:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The plant's equations; both of K1 and K2 stand in for K."""
        return precise_equations()

    def values(self, free: np.ndarray) -> Values:
        """Return all parameters by name, each a number for every braking; K1 and K2 beside K."""
        values = super().values(free)
        return {**values, **dict(zip(K1K2, brake_shoe(values["air_gain"]), strict=True))}

    def onsets(self, values: Values) -> np.ndarray:
        """Return when the air brake comes on in each braking (s)."""
        pairs = zip(self.brakings, values["air_delay"], values["changeover_speed"], strict=True)
        return np.array(
            [timer + b.passing(v)[0] if b.onset is None else b.onset for b, timer, v in pairs]
        )

    def _signals(self, values: Values) -> tuple[list[np.ndarray], list[np.ndarray]]:
        electric, air = (
            self._commands.delayed(values[name], self._start, self._width)
            for name in ("electric_delay", "air_delay")
        )
        shares, changes = self._phases(values)
        return (
            [electric.mean, electric.tilt, air.mean, air.tilt, *shares],
            [
                electric.mean_change,
                electric.tilt_change,
                air.mean_change,
                air.tilt_change,
                *changes,
            ],
        )

    def _phases(self, values: Values) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Return each step's shares of blending and air brake, and the blending's middle.

        With it, how they change with the onset.
        """
        onset = self.onsets(values)[:, None]
        faded = onset + (values["fade_reference"] / values["fade_rate"])[:, None]
        first, last = self._start, self._start + self._width
        h = np.where(self._width > 0.0, self._width, 1.0)
        begin, end = np.clip(onset, first, last), np.clip(faded, first, last)
        moves, follows = (((edge > first) & (edge < last)) * 1.0 for edge in (onset, faded))
        shares = [(end - begin) / h, (last - end) / h, 0.5 * (begin + end) - onset]
        changes = [(follows - moves) / h, -follows / h, 0.5 * (moves + follows) - 1.0]
        return shares, changes

    def _initial(self, values: Values) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        per_coefficient = self.first_command / values["mass_ratio"]
        return (
            values["electric_coefficient"] * per_coefficient,
            {"electric_coefficient": per_coefficient},
        )

    def _column(self, name: str, named: Mapping[str, np.ndarray], values: Values) -> np.ndarray:
        if name == "air_gain":  # with K2 held, K1 = 100 K2 K
            return named["air_numerator"] * 100.0 * DENOMINATOR
        if name not in ("air_delay", "changeover_speed"):
            return named[name]
        later = [0.0 if b.onset is not None else 1.0 for b in self.brakings]
        if name == "air_delay":
            return named[name] + np.array(later)[self.log_of_sample] * named["onset"]
        slopes = [
            unknown * b.passing(v)[1]
            for b, unknown, v in zip(self.brakings, later, values["changeover_speed"], strict=True)
        ]
        return np.array(slopes)[self.log_of_sample] * named["onset"]


def brake_shoe(gain: Any) -> tuple[Any, Any]:
    """Return K1 and K2 for a gain K (m/s²), of which only the ratio acts: K2 is the paper's."""
    return 100.0 * DENOMINATOR * gain, 0.0 * gain + DENOMINATOR


def separate_coefficients(
    model: PreciseModel, free: np.ndarray
) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    """Return symbols, sizes and Jacobian with K1 and K2 in the place of K, as in eq. 11."""
    values = model.values(free)
    _, jacobian = model.errors_and_jacobian(free)
    _, named = model.sensitivities(values)
    kept = [i for i, p in enumerate(model.free) if p.name != "air_gain"]
    symbols = (*(model.free[i].symbol for i in kept), "K1", "K2")
    size = [*model.size(free)[kept], *(float(values[name][0]) for name in K1K2)]
    columns = [*(jacobian[:, i] for i in kept), *(named[name] for name in K1K2)]
    return symbols, np.array(size), np.column_stack(columns)
