"""A ramp."""

from dataclasses import dataclass
from typing import Any

from ..block import require_finite
from .source import Source


@dataclass(frozen=True, kw_only=True, slots=True)
class Ramp(Source):
    """y(t) = initial for t < at, else initial + slope · (t − at); slope in the unit per second."""

    slope: float = 1.0
    at: float = 0.0
    initial: float = 0.0

    timed = True
    continuous = True

    def __post_init__(self) -> None:
        Source.__post_init__(self)
        require_finite(self, "slope", "at", "initial")

    def output(self, x: Any, t: float) -> float:
        """Return the value at time t (s)."""
        return self.initial if t < self.at else self.initial + self.slope * (t - self.at)
