"""The target speed of a run into a station: one regulation step, then the stopping curve."""

from dataclasses import dataclass
from typing import Any

from ..base.ops import is_symbol, maximum, minimum, sqrt, where
from ..cosim.block import Block, require, require_finite, require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class BrakingPattern(Block):
    """ATO's target speed over place s (m): the pattern of the adaptive fuzzy ATO paper, Fig. 1.

    `cruise` (m/s) before `regulation_from` (m). From there on one regulation step down to
    `regulated` (m/s), and from where the stopping curve sqrt(2 · braking · (stop − s)) meets
    that speed, the curve; 0 beyond `stop` (m). `braking` (m/s²) is the deceleration of the
    stopping curve. The figure has no numbers: they are the user's. Raise ParameterError for a
    wrong number, or a step down that would come on the stopping curve only.
    """

    cruise: float
    regulated: float
    regulation_from: float
    stop: float
    braking: float
    period: float = 0.05

    inputs = {"position": "m"}
    outputs = {"target": "m/s"}

    def __post_init__(self) -> None:
        require_positive(self, "cruise", "regulated", "braking", "period")
        require_finite(self, "regulation_from", "stop")
        # Any: a parameter may be a symbol, which is not compared.
        numbers: tuple[Any, ...] = (
            self.cruise, self.regulated, self.regulation_from, self.stop, self.braking,
        )  # fmt: skip
        if any(is_symbol(v) for v in numbers):
            return
        require(
            self,
            self.regulated <= self.cruise,
            f"regulated must not be above cruise ({self.cruise:g} m/s), not {self.regulated:g} m/s",
        )
        require(
            self,
            self.regulation_from <= self.braking_from,
            f"regulation_from must lie before {self.braking_from:g} m, where the stopping curve "
            f"meets {self.regulated:g} m/s, not at {self.regulation_from:g} m",
        )

    @property
    def braking_from(self) -> float:
        """The place (m) where the stopping curve begins: it meets the regulated speed there."""
        return self.stop - self.regulated * self.regulated / (2.0 * self.braking)

    def step(self, x: Any, position: Any) -> tuple[Any, Any]:
        """Return (the target speed in m/s, no state)."""
        curve = sqrt(2.0 * self.braking * maximum(self.stop - position, 0.0))
        regulated = minimum(self.regulated, curve)
        return where(position < self.regulation_from, self.cruise, regulated), x
