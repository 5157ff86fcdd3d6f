"""A quantiser."""

from dataclasses import dataclass
from typing import Any

from ...base.ops import round_half_away
from ..block import Block, require_positive


@dataclass(frozen=True, slots=True)
class Quantiser(Block):
    """y = interval · round(u / interval), halves away from zero, as Simulink's Quantizer.

    For handles with notches and sensors with a resolution. It is sampled at every step.
    """

    interval: float

    inputs = {"u": None}
    outputs = {"y": None}

    def __post_init__(self) -> None:
        require_positive(self, "interval")

    def step(self, x: Any, u: Any) -> tuple[Any, Any]:
        """Return (the nearest multiple of the interval, no state)."""
        return self.interval * round_half_away(u / self.interval), x
