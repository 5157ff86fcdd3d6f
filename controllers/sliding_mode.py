"""Sliding mode control of a train on its target curve (SMC)."""

from dataclasses import dataclass
from typing import Any

from ..base.ops import clip, where
from ..cosim.block import Block, require_finite, require_positive

# Inputs that all controllers of a tracked stop share, and their output
ERRORS = {"position_error": "m", "speed_error": "m/s", "acceleration": "m/s2", "resistance": "m/s2"}
COMMAND = {"command": "m/s2"}


def switched(z: Any, boundary: float | None) -> Any:
    """Return sgn(z), or sat(z/boundary) where there is a boundary layer (m/s)."""
    if boundary is None:
        return where(z > 0.0, 1.0, where(z < 0.0, -1.0, 0.0))
    return clip(z / boundary, -1.0, 1.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class SlidingMode(Block):
    """u = θ q − k_s z − η sgn(z), z = c e + e', q = a_d − c e' + r (precise braking paper, eq. 22).

    e = x − x_d (m), its rate e' (m/s) and the target's acceleration a_d are inputs, and so is the
    running resistance r (m/s²) that the train is known to have: the feed-forward. `surface` is c
    (1/s), `reaching` k_s (1/s), `robust` η (m/s²); `boundary` Φ (m/s) makes sgn(z) sat(z/Φ), our
    choice against chattering. `mass` θ is the command for 1 m/s²: 1/0.85 by the paper's table 1.
    The paper's SMC is its SMARC without the adaptation of θ.
    """

    surface: float
    reaching: float
    robust: float
    boundary: float | None = None
    mass: float = 1.0 / 0.85
    period: float = 0.2

    inputs = ERRORS
    outputs = COMMAND

    def __post_init__(self) -> None:
        require_positive(self, "mass", "period")
        require_finite(self, "surface", "reaching", "robust")
        if self.boundary is not None:
            require_positive(self, "boundary")

    def step(
        self, x: Any, position_error: Any, speed_error: Any, acceleration: Any, resistance: Any
    ) -> tuple[Any, Any]:
        """Return (command in m/s², no state)."""
        z = self.surface * position_error + speed_error
        q = acceleration - self.surface * speed_error + resistance
        u = self.mass * q - self.reaching * z - self.robust * switched(z, self.boundary)
        return u, x
