"""PID control of a train's position on its target curve, with feed-forward."""

from dataclasses import dataclass
from typing import Any

from ..cosim.block import Block, require_finite, require_positive
from .sliding_mode import COMMAND, ERRORS


@dataclass(frozen=True, kw_only=True, slots=True)
class PositionPID(Block):
    """u = θ (a_d + r) − kp e − ki ∫e dt − kd e', e = x − x_d; our choice beside `SpeedPID`.

    The derivative is the measured speed's error, not a difference of positions.
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

    def start(self) -> float:
        """Return ∫e dt."""
        return 0.0

    def step(
        self, x: Any, position_error: Any, speed_error: Any, acceleration: Any, resistance: Any
    ) -> tuple[Any, Any]:
        """Return (command in m/s², next ∫e dt)."""
        integral = x + self.period * position_error
        feedback = self.kp * position_error + self.ki * integral + self.kd * speed_error
        return self.mass * (acceleration + resistance) - feedback, integral
