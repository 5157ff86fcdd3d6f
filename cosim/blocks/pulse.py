"""A single rectangular pulse."""

import math
from dataclasses import dataclass, field
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
    _end: float = field(init=False, repr=False, compare=False)

    timed = True

    def __post_init__(self) -> None:
        Source.__post_init__(self)
        require_finite(self, "at", "height", "base")
        require_positive(self, "width")
        object.__setattr__(self, "_end", plus(self.at, self.width))

    def output(self, x: Any, t: float) -> float:
        """Return the value at time t (s)."""
        return self.height if self.at <= t < self._end else self.base

    def next_event(self, x: Any, t: float) -> float:
        """Return the time (s) of the next edge."""
        return self.at if t < self.at else self._end if t < self._end else math.inf
