"""A disturbance observer: what accelerates a train beyond its nominal model."""

from dataclasses import dataclass
from typing import Any

from ..base.ops import clip
from ..cosim.block import Block, require, require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class DisturbanceObserver(Block):
    """d⁺ = d + (gain + air_gain · (1 − share)) · (measured − predicted)/period, in m/s².

    `predicted` is the speed that a model, corrected by d, gave for this sample one period ago;
    `share` is the electric brake's share in the braking: what is learnt quickly is what the air
    brake does. d is limited to ±`limit`. The observer is the precise braking paper's named future
    work; this form is our choice.
    """

    gain: float
    air_gain: float = 0.0
    limit: float = 0.3
    period: float = 0.2

    inputs = {"measured": "m/s", "predicted": "m/s", "share": "1"}
    outputs = {"disturbance": "m/s2"}

    def __post_init__(self) -> None:
        require_positive(self, "limit", "period")
        for name in ("gain", "air_gain"):
            value: Any = getattr(self, name)
            good = not isinstance(value, int | float) or 0.0 <= value <= 1.0
            require(self, good, f"{name} must be a share from 0 to 1, not {value!r}")

    def start(self) -> float:
        """Return the disturbance."""
        return 0.0

    def step(self, x: Any, measured: Any, predicted: Any, share: Any) -> tuple[Any, Any]:
        """Return (disturbance in m/s², it again as the next state)."""
        gain = self.gain + self.air_gain * (1.0 - share)
        d = clip(x + gain * (measured - predicted) / self.period, -self.limit, self.limit)
        return d, d
