"""What a handling plan has to know of a train, as plain numbers."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from ...base.errors import ParameterError
from ...base.railway import KILOMETRES_PER_HOUR

Pairs = tuple[tuple[float, float], ...]


def ramps(x: Any, points: Sequence[tuple[float, float]]) -> Any:
    """Return the straight lines through the points at x, level beyond them; x may be a symbol."""
    import casadi as ca

    value, slope = points[0][1], 0.0
    for (a, f), (b, g) in pairwise([*points, (math.inf, points[-1][1])]):
        steeper = (g - f) / (b - a)
        value = value + (steeper - slope) * ca.fmax(x - a, 0.0)
        slope = steeper
    return value


@dataclass(frozen=True, kw_only=True)
class ForceCurve:
    """The largest force (N) of all locomotives together over the speed (m/s).

    Straight lines through `points`, level beyond them, and at most `power` (W) over the speed.
    Raise ParameterError for a curve that cannot be.
    """

    points: Pairs
    power: float = math.inf

    def __post_init__(self) -> None:
        rising = all(a < b for (a, _), (b, _) in pairwise(self.points))
        flat = [number for point in self.points for number in point]
        if not (flat and rising and all(math.isfinite(n) and n >= 0.0 for n in flat)):
            raise ParameterError(
                f"force curve: needs (m/s, N) points with rising speeds, not {self.points!r}"
            )
        if not self.power > 0.0:
            raise ParameterError(f"force curve: power must be positive, not {self.power!r} W")

    def at(self, speed: Any) -> Any:
        """Return the force at a positive speed; numbers, arrays and symbols alike."""
        import casadi as ca

        return ca.fmin(ramps(speed, self.points), self.power / speed)


@dataclass(frozen=True, kw_only=True)
class ReducedBrake:
    """The air brake of one wagon; all braked ones are alike.

    A reduction of r kPa leads to the share c(r) of the `full_pressure` (kPa) in the cylinder:
    `service` has (r, c) pairs. The share follows with the time constants `application_time` and
    `release_time` (s), both with the pipe's delay added in the mean over the train. Each of `shoes`
    is pressed with K = `area` (m²) times the pressure, in kN, and brakes with K φ (heavy-haul
    paper, eq. 7). A brake is applied with `minimum` kPa at least, with `maximum` at most.
    """

    full_pressure: float
    area: float
    shoes: float
    service: Pairs
    application_time: float
    release_time: float
    minimum: float = 50.0
    maximum: float = 170.0

    def __post_init__(self) -> None:
        numbers = (
            self.full_pressure, self.area, self.shoes, self.application_time, self.release_time,
        )  # fmt: skip
        if not all(math.isfinite(n) and n > 0.0 for n in numbers):
            raise ParameterError(f"reduced brake: its numbers must be positive, not {numbers}")
        if not 0.0 < self.minimum < self.maximum <= self.service[-1][0]:
            raise ParameterError(
                f"reduced brake: minimum and maximum ({self.minimum:g}, {self.maximum:g} kPa) must "
                f"lie in that order within the service curve, to {self.service[-1][0]:g} kPa"
            )

    def settled(self, reduction: Any) -> Any:
        """Return the cylinder's share of the full pressure at a steady reduction (kPa)."""
        return ramps(reduction, self.service)

    def force(self, share: Any, speed: Any) -> Any:
        """Return the force (N) of one wagon's shoes."""
        k = self.area * self.full_pressure * share
        v = KILOMETRES_PER_HOUR * speed
        friction = 0.41 * (k + 200.0) / (4.0 * k + 200.0) * (v + 150.0) / (2.0 * v + 150.0)
        return 1e3 * self.shoes * k * friction


@dataclass(frozen=True, kw_only=True)
class ReducedTrain:
    """A train for planning: one entry each for every vehicle, from the front.

    - `masses` in kg, `lengths` in m.
    - `resistances`: (constant, linear, quadratic) in N/kN, N/kN per km/h and per (km/h)².
    - `shares` of the locomotives' force that the vehicle has; they add up to 1.
    - `traction` and `electric_brake` of all locomotives together.
    - `brake` of each vehicle for which `braked` is true; None if the air brake is not to be used.
      `without_brake` says why, to whoever wants to plan with it.

    Raise ParameterError for a train that cannot be.
    """

    masses: tuple[float, ...]
    lengths: tuple[float, ...]
    resistances: tuple[tuple[float, float, float], ...]
    shares: tuple[float, ...]
    traction: ForceCurve
    electric_brake: ForceCurve
    braked: tuple[bool, ...] = ()
    brake: ReducedBrake | None = None
    without_brake: str = ""

    def __post_init__(self) -> None:
        size = len(self.masses)
        for name in ("lengths", "resistances", "shares", *(("braked",) if self.brake else ())):
            if len(getattr(self, name)) != size or size < 2:
                raise ParameterError(
                    f"reduced train: {size} masses, {len(getattr(self, name))} {name}; needs one "
                    "each for two vehicles or more"
                )
        for name in ("masses", "lengths"):
            if not all(math.isfinite(n) and n > 0.0 for n in getattr(self, name)):
                raise ParameterError(f"reduced train: {name} must be positive")
        if min(self.shares) < 0.0 or abs(sum(self.shares) - 1.0) > 1e-9:
            raise ParameterError(
                f"reduced train: the shares of the force must add up to 1, not {sum(self.shares):g}"
            )

    @property
    def mass(self) -> float:
        """The mass of all vehicles in kg."""
        return sum(self.masses)

    @property
    def length(self) -> float:
        """The length over all vehicles in m."""
        return sum(self.lengths)
