"""Where a train will stop if it goes on braking as planned."""

from dataclasses import dataclass
from typing import Any

from ..cosim.block import Block, require_finite, require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class StopPrediction(Block):
    """error = mark − (position + speed²/(2 · braking)) in cm: positive when it stops short.

    `mark` in m, `braking` the planned deceleration in m/s². Our reading of the station stop
    paper's E = g − x, with x not the place where the train is but where it will stand.
    """

    braking: float
    mark: float = 0.0
    period: float = 0.1

    inputs = {"position": "m", "speed": "m/s"}
    outputs = {"error": "cm"}

    def __post_init__(self) -> None:
        require_positive(self, "braking", "period")
        require_finite(self, "mark")

    def step(self, x: Any, position: Any, speed: Any) -> tuple[Any, Any]:
        """Return (error in cm, no state)."""
        return 100.0 * (self.mark - (position + speed * speed / (2.0 * self.braking))), x
