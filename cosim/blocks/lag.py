"""A first-order lag."""

import math
from dataclasses import dataclass
from typing import Any

from ...base.ops import finite
from ..block import Block, require, require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class Lag(Block):
    """time · y' = u − y from y = `initial`, sampled every `period` (s), exact for a held input.

    y(t) is the state: an input reaches it one sample later at the earliest.
    """

    time: float
    period: float
    initial: float = 0.0

    inputs = {"u": None}
    outputs = {"y": None}
    feedthrough = False

    def __post_init__(self) -> None:
        require_positive(self, "time", "period")
        require(self, finite(self.initial), f"initial must be a number, not {self.initial!r}")

    def start(self) -> float:
        """Return y at the start."""
        return float(self.initial)

    def output(self, x: Any) -> Any:
        """Return y."""
        return x

    def update(self, x: Any, u: Any) -> Any:
        """Return y at the next sample."""
        return x + (1.0 - math.exp(-self.period / self.time)) * (u - x)
