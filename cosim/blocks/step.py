"""A step."""

import math
from dataclasses import dataclass
from typing import Any

from ..block import require_finite
from .source import Source


@dataclass(frozen=True, kw_only=True, slots=True)
class Step(Source):
    """y(t) = before for t < at, else to."""

    at: float = 0.0
    to: float = 1.0
    before: float = 0.0

    timed = True

    def __post_init__(self) -> None:
        Source.__post_init__(self)
        require_finite(self, "at", "to", "before")

    def output(self, x: Any, t: float) -> float:
        """Return the value at time t (s)."""
        return self.before if t < self.at else self.to

    def next_event(self, x: Any, t: float) -> float:
        """Return the time (s) of the step while it lies ahead."""
        return self.at if t < self.at else math.inf
