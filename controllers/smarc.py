"""Sliding mode adaptive robust control of a train on its target curve (SMARC)."""

from dataclasses import dataclass
from typing import Any

from ..base.ops import clip, is_symbol, where
from ..cosim.block import Block, require, require_finite, require_limits, require_positive
from .sliding_mode import COMMAND, ERRORS, switched


@dataclass(frozen=True, kw_only=True, slots=True)
class SMARC(Block):
    """u = θ̂ q − k_s z − η sgn(z), θ̂' = Proj(−λ z q) (precise braking paper, eqs. 17 to 27).

    z, q and all but θ̂ as in `SlidingMode`. θ̂ begins at `mass`, learns at the rate `adaptation` λ
    once a period by Euler's rule, and stays within `bounds`: Proj stops it there, and what a
    whole period would overshoot is cut off. The printed eqs. 19 to 23 carry a stray z and the
    target's speed for its acceleration, and eq. 27 would let θ̂ pass its bounds; this is our
    reading. The second output is the θ̂ that was used.
    """

    surface: float
    reaching: float
    robust: float
    adaptation: float
    boundary: float | None = None
    mass: float = 1.0 / 0.85
    bounds: tuple[float, float] = (0.8, 1.7)
    period: float = 0.2

    inputs = ERRORS
    outputs = {**COMMAND, "mass": "1"}

    def __post_init__(self) -> None:
        require_positive(self, "mass", "period")
        require_finite(self, "surface", "reaching", "robust", "adaptation")
        require_limits(self, "bounds")
        if self.boundary is not None:
            require_positive(self, "boundary")
        if not is_symbol(self.mass):
            low, high = self.bounds
            require(self, low <= self.mass <= high, f"mass must lie within bounds {self.bounds!r}")

    def start(self) -> float:
        """Return θ̂."""
        return self.mass

    def step(
        self, x: Any, position_error: Any, speed_error: Any, acceleration: Any, resistance: Any
    ) -> tuple[Any, Any]:
        """Return ((command in m/s², θ̂), next θ̂)."""
        z = self.surface * position_error + speed_error
        q = acceleration - self.surface * speed_error + resistance
        u = x * q - self.reaching * z - self.robust * switched(z, self.boundary)
        low, high = self.bounds
        rate = -self.adaptation * z * q
        rate = where(x >= high, where(rate > 0.0, 0.0, rate), rate)
        rate = where(x <= low, where(rate < 0.0, 0.0, rate), rate)
        return (u, x), clip(x + self.period * rate, low, high)
