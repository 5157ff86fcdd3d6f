"""A zero-order hold."""

from dataclasses import dataclass
from typing import Any

from ..block import Block, require_positive


@dataclass(frozen=True, slots=True)
class Hold(Block):
    """y(t) = u at the last sample hit: every `period` s from the run's start."""

    period: float

    inputs = {"u": None}
    outputs = {"y": None}

    def __post_init__(self) -> None:
        require_positive(self, "period")

    def step(self, x: Any, u: Any) -> tuple[Any, Any]:
        """Return (the sample, no state); the schedule does the holding."""
        return u, x
