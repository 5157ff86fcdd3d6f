"""What a handling has to do, and what it is to be good at."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...base.errors import ParameterError
from .checks import require_numbers, require_section

if TYPE_CHECKING:
    from ...models.line import Section

SLOWEST = 3.0  # m/s; plans are in the position, so the train has to keep moving


@dataclass(frozen=True, kw_only=True)
class Journey:
    """A way along a section in a given time, between two speeds above standstill.

    `start` and `end` (m) are places of the train's front, the section's length if no end is given;
    speeds in m/s, `time` in s. The speed stays within the section's limits, all along the train,
    and above 3 m/s. Raise ParameterError for what cannot be.
    """

    section: "Section"
    start_speed: float
    end_speed: float
    time: float
    start: float = 0.0
    end: float = math.nan

    def __post_init__(self) -> None:
        require_section("journey", self.section)
        name = f"journey on '{self.section.name}'"
        if isinstance(self.end, float) and math.isnan(self.end):
            object.__setattr__(self, "end", self.section.length)
        require_numbers(
            name, start_speed=self.start_speed, end_speed=self.end_speed, time=self.time,
            start=self.start, end=self.end,
        )  # fmt: skip
        if not 0.0 <= self.start < self.end <= self.section.length:
            raise ParameterError(
                f"{name}: must lead forward within 0 to {self.section.length:g} m, not from "
                f"{self.start:g} to {self.end:g} m"
            )
        for word, speed, place in (
            ("start", self.start_speed, self.start), ("end", self.end_speed, self.end),
        ):  # fmt: skip
            limit = self.section.limit_at(place)
            if not SLOWEST <= speed <= limit:
                raise ParameterError(
                    f"{name}: the speed at its {word} must be {SLOWEST:g} to {limit:g} m/s, not "
                    f"{speed:g}"
                )
        if not 0.0 < self.time < (self.end - self.start) / SLOWEST:
            raise ParameterError(
                f"{name}: {self.end - self.start:g} m cannot take {self.time:g} s; a plan keeps "
                f"above {SLOWEST:g} m/s"
            )

    @property
    def length(self) -> float:
        """The way in m."""
        return self.end - self.start


@dataclass(frozen=True, kw_only=True)
class Aims:
    """Weights of what is minimised; each term is 1 where its quantity has its reference.

    - `rms`: mean square of the coupler forces, over time and couplers, over `force`².
    - `peak`: square of the largest |force|, over `force`².
    - `rate`: mean square of the forces' rate of change over (`force`/`span`)². Forces that
      change slowly take up slack slowly.
    - `energy`: traction's work over `force` times the way.

    `force` in N, `span` in s. All our choice.
    """

    rms: float = 1.0
    peak: float = 1.0
    rate: float = 1.0
    energy: float = 1.0
    force: float = 300e3
    span: float = 30.0

    def __post_init__(self) -> None:
        require_numbers("aims", **vars(self))
        weights = (self.rms, self.peak, self.rate, self.energy)
        if min(weights) < 0.0 or self.rms + self.rate <= 0.0:
            raise ParameterError(
                f"aims: weights must be numbers from 0, rms or rate above it, not {weights}"
            )
        if not (self.force > 0.0 and self.span > 0.0):
            raise ParameterError("aims: force and span must be positive")
