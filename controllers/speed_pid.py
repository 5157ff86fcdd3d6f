"""PID control of a train's speed on its target curve, with feed-forward."""

from dataclasses import dataclass
from typing import Any

from ..base.ops import where
from ..cosim.block import Block, require_finite, require_positive
from .sliding_mode import COMMAND, ERRORS


@dataclass(frozen=True, kw_only=True, slots=True)
class SpeedPID(Block):
    """u = θ (a_d + r) − kp e' − ki ∫e' dt − kd de'/dt, e' = v − v_d.

    The PID that the precise braking paper compares with; it gives no numbers. The feed-forward,
    θ = `mass` times the target's acceleration and the known resistance, is the one that
    `SlidingMode` has. The position error is an input, as of all controllers of a tracked stop,
    but is not used.
    """

    kp: float
    ki: float = 0.0
    kd: float = 0.0
    mass: float = 1.0 / 0.85
    period: float = 0.2

    inputs = ERRORS
    outputs = COMMAND

    def __post_init__(self) -> None:
        require_positive(self, "mass", "period")
        require_finite(self, "kp", "ki", "kd")

    def start(self) -> tuple[float, float, float]:
        """Return (∫e' dt, the last e', whether the next sample is the first)."""
        return 0.0, 0.0, 1.0

    def step(
        self, x: Any, position_error: Any, speed_error: Any, acceleration: Any, resistance: Any
    ) -> tuple[Any, Any]:
        """Return (command in m/s², next state)."""
        integral, last, first = x
        integral = integral + self.period * speed_error
        rate = (speed_error - where(first > 0.5, speed_error, last)) / self.period
        feedback = self.kp * speed_error + self.ki * integral + self.kd * rate
        return self.mass * (acceleration + resistance) - feedback, (integral, speed_error, 0.0)
