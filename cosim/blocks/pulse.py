"""A single rectangular pulse."""

from dataclasses import dataclass
from typing import Any

from ..block import require_finite, require_positive
from ..clock import plus
from .source import Source


@dataclass(frozen=True, kw_only=True, slots=True)
class Pulse(Source):
    """y(t) = height for at ≤ t < at + width (s), else base."""

    at: float = 0.0
    width: float = 1.0
    height: float = 1.0
    base: float = 0.0

    timed = True

    def __post_init__(self) -> None:
        Source.__post_init__(self)
        require_finite(self, "at", "height", "base")
        require_positive(self, "width")

    def output(self, x: Any, t: float) -> float:
        """Return the value at time t (s)."""
        return self.height if self.at <= t < plus(self.at, self.width) else self.base
