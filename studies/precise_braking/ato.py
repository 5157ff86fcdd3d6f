"""A plain automatic train operation for making logs: a target speed, feed-forward and PI."""

from dataclasses import dataclass
from typing import Any

from ...base.ops import clip, maximum, minimum, sqrt, where
from ...cosim.block import Block, require_positive
from .loop import PERIOD

STANDING = 0.25  # m/s; slower, the holding brake is commanded
SLOW = 1.0  # m/s; slower, the brake is not released


@dataclass(frozen=True, kw_only=True, slots=True)
class PlainATO(Block):
    """Command u = f + kp e + I with e = target − measured speed; our choice throughout.

    The target is `cruise` up to where a constant `deceleration` ends at position 0, and f what
    the nominal train needs for it: the command over `efficiency`, ahead by `lead` (s) of its
    delays. u is limited to [−1, 0.5] m/s², and its change to `ramp` a sample.
    """

    cruise: float = 14.0
    deceleration: float = 0.70
    efficiency: float = 0.85
    lead: float = 1.7
    kp: float = 0.20
    ki: float = 0.02
    resistance: float = 0.05
    hold: float = 0.05
    ramp: float = 0.1
    period: float = PERIOD

    inputs = {"position": "m", "speed": "m/s"}
    outputs = {"command": "m/s2"}

    def __post_init__(self) -> None:
        require_positive(self, "cruise", "deceleration", "efficiency", "period", "ramp")

    def start(self) -> tuple[float, float]:
        """Return (integral, last command): as before, the command that holds the speed."""
        return 0.0, self.hold

    def step(self, x: Any, position: Any, speed: Any) -> tuple[Any, Any]:
        """Return (u, next state)."""
        integral, last = x
        target = minimum(self.cruise, sqrt(2.0 * self.deceleration * maximum(-position, 0.0)))
        ahead = -position - speed * self.lead  # m, when the command acts
        braking = ahead <= self.cruise * self.cruise / (2.0 * self.deceleration)
        error = where(braking, target, self.cruise) - speed
        grown = clip(integral + self.ki * self.period * error, -0.1, 0.1)
        needed = (self.resistance - self.deceleration) / self.efficiency
        wanted = where(braking, needed, self.hold) + self.kp * error + grown
        wanted = where(speed < SLOW, minimum(wanted, -0.15), wanted)
        u = clip(clip(wanted, last - self.ramp, last + self.ramp), -1.0, 0.5)
        u = where(speed < STANDING, -0.5, u)
        return u, (grown, u)
