"""The brake that holds a train once it has stopped."""

from dataclasses import dataclass
from typing import Any

from ..base.ops import where
from ..cosim.block import Block, require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class HoldingBrake(Block):
    """Demand `force` (N) while both target and speed lie below `below` (m/s), else 0.

    An automatic train operation applies it at the end of a stop, where a curve down to speed 0
    leaves nothing to control, and lets go when the target rises again. Our choice.
    """

    force: float
    below: float = 0.1
    period: float = 0.02

    inputs = {"target": "m/s", "speed": "m/s"}
    outputs = {"brake": "N"}

    def __post_init__(self) -> None:
        require_positive(self, "force", "below", "period")

    def step(self, x: Any, target: Any, speed: Any) -> tuple[Any, Any]:
        """Return (brake force demanded, no state)."""
        slow = where(target < self.below, where(speed < self.below, 1.0, 0.0), 0.0)
        return slow * self.force, x
