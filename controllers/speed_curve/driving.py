"""What binds a target speed curve: the style of driving, and the train's course along a section."""

import math
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.errors import ParameterError
from ...base.ops import clip
from ...base.railway import GRAVITY_PER_MILLE

if TYPE_CHECKING:
    from ...models.line import Section, Train


@dataclass(frozen=True, kw_only=True)
class Driving:
    """How a train is to be driven; the numbers are our choice.

    `jerk` (m/s³) bounds the rate of the acceleration. `deceleration` (m/s²) is that of braking,
    resistance included; the train's service brake bounds it. The curve ends at speed 0 with the
    deceleration `final_deceleration` (m/s²): 0 is the softest stop, and a little more than 0 one
    that a brake can hold to the end. `traction_share` is how much of the traction's force and
    power a curve may use: the rest is left to the control. Raise ParameterError for numbers that
    cannot be.
    """

    jerk: float = 0.5
    deceleration: float = 0.7
    final_deceleration: float = 0.25
    traction_share: float = 0.95

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ParameterError(f"driving: {field.name} must not be negative, but is {value}")
        for name in ("jerk", "deceleration", "traction_share"):
            if getattr(self, name) == 0.0:
                raise ParameterError(f"driving: {name} must be positive, but is 0")
        if self.traction_share > 1.0:
            raise ParameterError(
                f"driving: traction_share is at most 1, but is {self.traction_share:g}"
            )
        if self.final_deceleration > self.deceleration:
            raise ParameterError(
                f"driving: final_deceleration ({self.final_deceleration:g} m/s²) must not be above "
                f"deceleration ({self.deceleration:g} m/s²)"
            )


@dataclass(frozen=True)
class Course:
    """A section as a train meets it under a style of driving; positions (m) are of its front.

    The section's limits are those of the track: here they hold until the train's rear has left
    them. Its gradient is the mean over the train's length. Raise ParameterError for a limit that
    lets nothing pass, and for a service brake that the driving asks too much of.
    """

    section: "Section"
    train: "Train"
    driving: Driving = Driving()

    def __post_init__(self) -> None:
        asked, has = self.driving.deceleration, self.train.service_deceleration
        if asked > has:
            raise ParameterError(
                f"driving: deceleration {asked:g} m/s² is above the service brake of "
                f"'{self.train.name}' ({has:g} m/s²)"
            )
        for position, limit in self.section.speed_limits:
            if not limit > 0.0:
                raise ParameterError(
                    f"section '{self.section.name}': the speed limit from {position:g} m is "
                    f"{limit:g} m/s; no train gets past it"
                )

    @cached_property
    def inertia(self) -> float:
        """The effective mass in kg, rotating masses included."""
        return self.train.mass * self.train.rotating_mass_factor

    @cached_property
    def limits(self) -> tuple[tuple[float, float], ...]:
        """The front's speed limits: (position where it begins, m/s), neighbours different."""
        ends = [*(start for start, _ in self.section.speed_limits[1:]), math.inf]
        pieces = [
            (start, end + self.train.length, min(value, self.train.max_speed))
            for (start, value), end in zip(self.section.speed_limits, ends, strict=True)
        ]
        borders = sorted({p for start, end, _ in pieces for p in (start, end)} - {math.inf})
        found: list[tuple[float, float]] = []
        for border in borders:
            value = min(v for start, end, v in pieces if start <= border < end)
            if border < self.section.length and (not found or found[-1][1] != value):
                found.append((border, value))
        return tuple(found)

    @cached_property
    def slopes(self) -> tuple[tuple[float, float], ...]:
        """The changes of gradient: (position, ‰), the first one to the gradient at the start."""
        steps = self.section.gradients
        return steps[0], *((p, b - a) for (_, a), (p, b) in pairwise(steps))

    @cached_property
    def kinks(self) -> tuple[float, ...]:
        """The positions where the train's mean gradient begins to change or ends to, rising."""
        starts = [p for p, _ in self.slopes[1:]]
        return tuple(sorted({*starts, *(p + self.train.length for p in starts)}))

    def lowest_limits(self, positions: np.ndarray) -> np.ndarray:
        """Return the limits (m/s) at positions; where one changes, the higher."""
        starts, values = np.array(self.limits).T
        after = np.searchsorted(starts, positions, side="right") - 1
        before = np.searchsorted(starts, positions, side="left") - 1
        return np.maximum(values[np.maximum(after, 0)], values[np.maximum(before, 0)])

    def resistance(self, speed: Any, position: Any) -> Any:
        """Return the deceleration (m/s²) by resistance and gradient; floats, arrays or symbols."""
        slope = self.slopes[0][1]
        length = self.train.length
        for start, change in self.slopes[1:]:
            share = (position - start) / length
            inside = np.clip(share, 0.0, 1.0) if _is_array(share) else clip(share, 0.0, 1.0)
            slope = slope + change * inside
        scale = GRAVITY_PER_MILLE * self.train.mass / self.inertia
        return scale * (self.train.davis.at(speed) + slope)

    @cached_property
    def top(self) -> float:
        """The highest of the limits in m/s."""
        return max(v for _, v in self.limits)

    @cached_property
    def strongest(self) -> tuple[float, float]:
        """The traction's largest acceleration (m/s²) by force, and power by mass (W/kg)."""
        share = self.driving.traction_share / self.inertia
        return share * self.train.max_traction_force, share * self.train.max_power

    def traction(self, speed: Any) -> Any:
        """Return the largest acceleration (m/s²) by traction, resistance not deducted."""
        if not _is_array(speed):
            share = self.driving.traction_share / self.inertia
            return share * self.train.traction_force(speed)
        force, power = self.strongest
        most = np.minimum(force, power / np.maximum(speed, 1e-9))
        if self.train.traction_curve:
            speeds, forces = zip(*self.train.traction_curve, strict=True)
            share = self.driving.traction_share / self.inertia
            most = np.minimum(most, share * np.interp(speed, speeds, forces))
        return most


def _is_array(value: Any) -> bool:
    return isinstance(value, np.ndarray)
