"""A run as it is put together, span by span."""

import numpy as np

from .curve import Regime, SpeedCurve
from .driving import Course

SHORTEST = 1e-12  # s; a span below is none


class Run:
    """Spans of constant jerk from standstill at position 0 on; where they have led so far."""

    def __init__(self) -> None:
        self.time = self.position = self.speed = self.acceleration = 0.0
        self._knots = [(0.0, 0.0, 0.0, 0.0)]
        self._regimes: list[Regime] = []

    def ahead(self, time: float, jerk: float) -> tuple[float, float, float]:
        """Return (position, speed, acceleration) after a time (s) of a jerk (m/s³)."""
        a = self.acceleration
        return (
            self.position + time * (self.speed + time * (a / 2.0 + time * jerk / 6.0)),
            self.speed + time * (a + time * jerk / 2.0),
            a + time * jerk,
        )

    def add(self, duration: float, jerk: float, regime: Regime) -> None:
        """Go on with a span."""
        if duration < SHORTEST:
            return
        self.position, self.speed, self.acceleration = self.ahead(duration, jerk)
        self.time += duration
        self._regimes.append(regime)
        self._knots.append((self.time, self.position, self.speed, self.acceleration))

    def settle(
        self, *, position: float | None = None, speed: float, acceleration: float = 0.0
    ) -> None:
        """Take rounding out of where the run is."""
        self.position = self.position if position is None else position
        self.speed, self.acceleration = speed, acceleration
        self._knots[-1] = (self.time, self.position, self.speed, self.acceleration)

    @property
    def traction_ends(self) -> float:
        """The position (m) at which traction ended for the last time."""
        last = max(k for k, regime in enumerate(self._regimes) if regime == "traction")
        return self._knots[last + 1][1]

    def curve(self, course: Course) -> SpeedCurve:
        """Return the curve."""
        time, position, speed, acceleration = (np.array(c) for c in zip(*self._knots, strict=True))
        return SpeedCurve.through(time, position, speed, acceleration, tuple(self._regimes), course)
