"""A saturation."""

from dataclasses import dataclass
from typing import Any

from ...base.ops import clip
from ..block import Block, require_limits


@dataclass(frozen=True, slots=True)
class Saturation(Block):
    """y = u limited to `limits` = (low, high)."""

    limits: tuple[float, float]

    inputs = {"u": None}
    outputs = {"y": None}
    continuous = True

    def __post_init__(self) -> None:
        require_limits(self)

    def step(self, x: Any, u: Any) -> tuple[Any, Any]:
        """Return (the limited value, no state)."""
        return clip(u, *self.limits), x
