"""A driver by plan: the planned force at the train's place, and a weak feedback of its speed."""

import math
from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Self

from ...base.ops import clip
from ...cosim.block import Block, require, require_finite, require_positive
from .checks import require_kind
from .handling import Handling
from .notches import lever

Floats = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class HandlingDriver(Block):
    """Force (N, of all locomotives) and pipe reduction (kPa) by the plan at the front's place.

    Straight lines through the plan's `position`, `speed`, `force` and `reduction`; its ends hold
    beyond it. force = planned + `gain` (N per m/s) · (planned − measured speed). With a `notch` (N)
    above 0 the lever is at a multiple of it, and goes to the nearest one when the wanted force is
    off by more than 0.75 notches. The force changes by `rate` (N/s) at most, beginning at 0, within
    the inputs `lower` and `upper` (N): what the locomotives can give now. All our choice.
    Raise ParameterError for wrong numbers.
    """

    position: Floats
    speed: Floats
    force: Floats
    reduction: Floats
    gain: float = 200e3
    notch: float = 0.0
    rate: float = 60e3
    period: float = 0.1

    inputs = {"position": "m", "speed": "m/s", "upper": "N", "lower": "N"}
    outputs = {"force": "N", "reduction": "kPa"}

    def __post_init__(self) -> None:
        require_positive(self, "rate", "period")
        require_finite(self, "gain", "notch")
        require(self, min(self.gain, self.notch) >= 0.0, "gain and notch must not be negative")
        size = len(self.position)
        for name in ("position", "speed", "force", "reduction"):
            values = getattr(self, name)
            good = len(values) == size >= 2 and all(map(math.isfinite, values))
            require(self, good, f"{name} needs a number for each of two places or more")
        rising = all(a < b for a, b in pairwise(self.position))
        require(self, rising, "the plan's places must rise")

    @classmethod
    def along(cls, handling: Handling, **options: Any) -> Self:
        """Return a driver by a handling; `options` are the block's other fields."""
        require_kind(cls.__name__, "handling", handling, Handling, "optimal_handling gives one")
        return cls(
            position=tuple(handling.position.tolist()),
            speed=tuple(handling.speed.tolist()),
            force=tuple(handling.force.tolist()),
            reduction=tuple(handling.reduction.tolist()),
            **{"notch": handling.notch, **options},
        )

    def start(self) -> tuple[float, float]:
        """Return (last force in N, the lever's notch)."""
        return 0.0, 0.0

    def step(self, x: Any, position: Any, speed: Any, upper: Any, lower: Any) -> tuple[Any, Any]:
        """Return ((force, reduction), next state)."""
        last, level = x
        k = min(max(bisect_right(self.position, position) - 1, 0), len(self.position) - 2)
        begin, end = self.position[k], self.position[k + 1]
        part = clip((position - begin) / (end - begin), 0.0, 1.0)
        target, wanted, reduction = (
            values[k] + part * (values[k + 1] - values[k])
            for values in (self.speed, self.force, self.reduction)
        )
        wanted += self.gain * (target - speed)
        if self.notch > 0.0:
            level = lever(wanted, self.notch, level)
            wanted = self.notch * level
        most = self.rate * self.period
        force = clip(clip(wanted, last - most, last + most), lower, upper)
        return (force, reduction), (force, level)
