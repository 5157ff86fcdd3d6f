"""The target curve of a stop: cruising, then braking with limited jerk, down to the aim."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ..base.ops import clip, is_symbol, maximum
from ..cosim.block import Block, require, require_finite, require_positive


class Target(NamedTuple):
    """A point of the target curve: position (m), speed (m/s), acceleration (m/s²)."""

    position: Any
    speed: Any
    acceleration: Any


@dataclass(frozen=True, kw_only=True, slots=True)
class BrakingProfile(Block):
    """x_d(t), v_d(t), a_d(t) of a stop at `aim` (m), in closed form.

    `speed` (m/s) for `lead_in` (s), then a deceleration that rises to `deceleration` (m/s²) by
    `jerk` (m/s³) and at the end falls to 0 by `end_jerk` (None: by `jerk`), exactly at the aim;
    from then on (aim, 0, 0). The precise braking paper gives no target curve; form and numbers
    are our choice. As a block it gives the curve at its samples. Raise ParameterError for a
    speed that the two ramps of the deceleration alone would use up.
    """

    speed: float = 14.0
    deceleration: float = 0.70
    jerk: float = 0.5
    end_jerk: float | None = None
    lead_in: float = 2.0
    aim: float = 0.0
    period: float = 0.2
    # Phases, time up to the aim, and slopes of the deceleration (m/s³): what `at` begins with.
    _curve: tuple[Any, ...] = field(init=False, repr=False, compare=False)

    outputs = {"position": "m", "speed": "m/s", "acceleration": "m/s2"}

    def __post_init__(self) -> None:
        require_positive(self, "speed", "deceleration", "jerk", "period")
        require_finite(self, "lead_in", "aim")
        if self.end_jerk is not None:
            require_positive(self, "end_jerk")
        if not is_symbol(self.lead_in):
            require(self, self.lead_in >= 0.0, f"lead_in must not be negative: {self.lead_in!r}")
        rising = self.deceleration / self.jerk
        falling = rising if self.end_jerk is None else self.deceleration / self.end_jerk
        steady = self.speed / self.deceleration - 0.5 * (rising + falling)
        togo = self.lead_in + (rising + steady + falling)
        slopes = self.deceleration / rising, self.deceleration / falling
        object.__setattr__(self, "_curve", (rising, steady, falling, togo, *slopes))
        if not is_symbol(steady):
            least = self.speed - self.deceleration * steady
            require(
                self, steady >= 0.0, f"speed must be at least {least:g} m/s for such slow ramps"
            )

    @property
    def phases(self) -> tuple[Any, Any, Any]:
        """The times (s) in which the deceleration rises, is steady, and falls."""
        rising, steady, falling, *_ = self._curve
        return rising, steady, falling

    @property
    def duration(self) -> Any:
        """The time (s) at which the curve reaches the aim."""
        return self.lead_in + sum(self.phases)

    @property
    def start_position(self) -> Any:
        """The place (m) where the curve begins."""
        return self.at(0.0).position

    def at(self, t: Any) -> Target:
        """Return the curve's point at time t (s) from its beginning."""
        rising, steady, falling, togo, j, k = self._curve
        a = self.deceleration
        # Counted back from the standstill: the time spent so far in each phase.
        togo = togo - t
        later = togo - falling
        early = later - steady
        third = clip(togo, 0.0, falling)
        second = clip(later, 0.0, steady)
        first = clip(early, 0.0, rising)
        cruise = maximum(early - rising, 0.0)
        v3 = 0.5 * k * third * third
        v2 = v3 + a * second
        v1 = v2 + first * (a - 0.5 * j * first)
        way = (
            v3 * third / 3.0
            + 0.5 * (v3 + v2) * second
            + first * (v2 + first * (0.5 * a - j * first / 6.0))
            + v1 * cruise
        )
        return Target(self.aim - way, v1, j * first - k * third)

    def start(self) -> float:
        """Return the number of the sample."""
        return 0.0

    def step(self, x: Any) -> tuple[Any, Any]:
        """Return ((position, speed, acceleration), next state)."""
        return tuple(self.at(x * self.period)), x + 1.0
