"""A target speed curve: position, speed and acceleration over time, from departure to stop."""

from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Self

import numpy as np

from ...base.errors import ParameterError
from ...base.railway import JOULES_PER_KWH
from .driving import Course, Driving

if TYPE_CHECKING:
    from ...models.line import Section, Train
    from .checks import Violation

Regime = Literal["traction", "cruise", "coast", "brake"]


class Point(NamedTuple):
    """Places of a curve: time (s), position (m), speed (m/s), acceleration (m/s²); arrays."""

    time: Any
    position: Any
    speed: Any
    acceleration: Any


class Phase(NamedTuple):
    """A stretch of one regime, from a time to a time (s)."""

    regime: Regime
    start: float
    end: float


@dataclass(frozen=True, kw_only=True, eq=False)
class SpeedCurve:
    """A run from standstill at position 0 to a stop, in spans of constant jerk.

    At the n + 1 knots: `time` (s, from 0), `position` (m), `speed` (m/s, positive between the
    ends), `acceleration` (m/s²). In between the acceleration is a straight line, so the speed is a
    parabola and the position a cubic, both smooth. `regimes` has one name for each of the n spans,
    "cruise" being any partial traction, and what holds the limit downhill. `energy` (J) is the
    traction's work at the wheel, ∫ max(F, 0) v dt. Raise ParameterError for knots that do not fit
    together.
    """

    time: np.ndarray
    position: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    regimes: tuple[Regime, ...]
    energy: float

    def __post_init__(self) -> None:
        shapes = {a.shape for a in (self.time, self.position, self.speed, self.acceleration)}
        if shapes != {(len(self.regimes) + 1,)} or not self.regimes:
            raise ParameterError("speed curve: its arrays need one knot more than spans")
        if not (np.diff(self.time) > 0.0).all():
            raise ParameterError("speed curve: its times must rise")
        span = np.diff(self.time)
        a, b = self.acceleration[:-1], self.acceleration[1:]
        speed = self.speed[:-1] + span * (a + b) / 2.0
        position = self.position[:-1] + span * (self.speed[:-1] + span * (2.0 * a + b) / 6.0)
        worst = max(
            float(np.abs(speed - self.speed[1:]).max()),
            float(np.abs(position - self.position[1:]).max()),
        )
        if not worst < 1e-6:
            raise ParameterError(f"speed curve: its knots miss each other by {worst:.2g} m or m/s")

    @classmethod
    def through(
        cls,
        time: np.ndarray,
        position: np.ndarray,
        speed: np.ndarray,
        acceleration: np.ndarray,
        regimes: tuple[Regime, ...],
        course: Course,
    ) -> Self:
        """Return the curve through knots with the energy that it takes on a course."""
        bare = cls(
            time=time, position=position, speed=speed, acceleration=acceleration,
            regimes=regimes, energy=0.0,
        )  # fmt: skip
        energy = course.inertia * bare._work(course)
        return cls(
            time=time, position=position, speed=speed, acceleration=acceleration,
            regimes=regimes, energy=energy,
        )  # fmt: skip

    def _work(self, course: Course) -> float:
        # Gauss' 5 points in each twentieth of a span: exact to rounding but for where force
        # changes its sign.
        nodes, weights = np.polynomial.legendre.leggauss(5)
        edges = np.linspace(self.time[:-1], self.time[1:], 21)
        half = np.diff(edges, axis=0) / 2.0
        middle = (edges[:-1] + edges[1:]) / 2.0
        at = self.at((middle[..., None] + half[..., None] * nodes).ravel())
        pull = at.acceleration + course.resistance(at.speed, at.position)
        return float(((half[..., None] * weights).ravel() * np.maximum(pull, 0.0) * at.speed).sum())

    @property
    def running_time(self) -> float:
        """From departure to stop, in s."""
        return float(self.time[-1])

    @property
    def length(self) -> float:
        """From departure to stop, in m."""
        return float(self.position[-1])

    @property
    def kilowatt_hours(self) -> float:
        """The traction's work at the wheel, in kWh."""
        return self.energy / JOULES_PER_KWH

    @cached_property
    def jerk(self) -> np.ndarray:
        """The jerk (m/s³) of each span."""
        return np.diff(self.acceleration) / np.diff(self.time)

    def at(self, time: Any) -> Point:
        """Return the curve at times (s); before 0 and after the stop the train stands."""
        t = np.clip(np.asarray(time, dtype=float), 0.0, self.time[-1])
        k = np.clip(np.searchsorted(self.time, t, side="right") - 1, 0, len(self.regimes) - 1)
        return self._inside(k, t - self.time[k])

    def at_position(self, position: Any) -> Point:
        """Return the curve where it passes positions (m), exact to rounding.

        Before 0 the train has not departed, beyond the stop it stands there.
        """
        s = np.clip(np.asarray(position, dtype=float), self.position[0], self.position[-1])
        k = np.searchsorted(self.position, s, side="right") - 1
        k = np.clip(k, 0, len(self.regimes) - 1)
        low, high = np.zeros_like(s), np.diff(self.time)[k]
        for _ in range(60):  # bisection: a cubic that rises, with speed 0 at the ends
            middle = (low + high) / 2.0
            beyond = self._inside(k, middle).position > s
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        return self._inside(k, high)

    def _inside(self, k: np.ndarray, t: np.ndarray) -> Point:
        j, a, v = self.jerk[k], self.acceleration[k], self.speed[k]
        last = self.time[k] + t >= self.time[-1]  # the stop is the knot, without rounding
        return Point(
            np.where(last, self.time[-1], self.time[k] + t),
            np.where(
                last, self.position[-1], self.position[k] + t * (v + t * (a / 2.0 + t * j / 6.0))
            ),
            np.where(last, self.speed[-1], v + t * (a + t * j / 2.0)),
            np.where(last, self.acceleration[-1], a + t * j),
        )

    def phases(self) -> tuple[Phase, ...]:
        """Return the stretches of one regime in the order of time."""
        found: list[Phase] = []
        for _, spans in groupby(range(len(self.regimes)), key=lambda k: self.regimes[k]):
            indices = list(spans)
            start, end = self.time[indices[0]], self.time[indices[-1] + 1]
            found.append(Phase(self.regimes[indices[0]], float(start), float(end)))
        return tuple(found)

    def violations(
        self, section: "Section", train: "Train", driving: Driving | None = None
    ) -> "tuple[Violation, ...]":
        """Return what the curve violates on a grid of 1 ms; nothing if it is as it should be."""
        from .checks import violations

        return violations(self, Course(section, train, driving or Driving()))
