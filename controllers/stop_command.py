"""The last stage of a stop's controller: what the command may be, near standstill above all."""

from dataclasses import dataclass
from typing import Any

from ..base.ops import clip, minimum, where
from ..cosim.block import Block, require, require_finite, require_limits, require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class StopCommand(Block):
    """Limits a command (m/s², negative brakes); our choice.

    Within `limits`; at most −`least_brake` below the speed `slow` (m/s); and below `hold` (m/s)
    the last command stays, so that the train comes to rest under a steady brake. `initial` is
    the last command before the first.
    """

    limits: tuple[float, float] = (-1.0, 0.5)
    least_brake: float = 0.15
    slow: float = 1.0
    hold: float = 0.25
    initial: float = -0.15
    period: float = 0.2

    inputs = {"wanted": "m/s2", "speed": "m/s"}
    outputs = {"command": "m/s2"}

    def __post_init__(self) -> None:
        require_limits(self)
        require_positive(self, "period")
        require_finite(self, "slow", "hold", "least_brake", "initial")
        require(self, self.hold <= self.slow, "hold must not be above slow")

    def start(self) -> float:
        """Return the last command."""
        return self.initial

    def step(self, x: Any, wanted: Any, speed: Any) -> tuple[Any, Any]:
        """Return (command, it again as the next state)."""
        u = clip(wanted, *self.limits)
        u = where(speed < self.slow, minimum(u, -self.least_brake), u)
        u = where(speed < self.hold, minimum(x, -self.least_brake), u)
        return u, u
