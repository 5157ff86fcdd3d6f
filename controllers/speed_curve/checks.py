"""The check of a target speed curve on a fine grid."""

from typing import NamedTuple

import numpy as np

from .curve import SpeedCurve
from .driving import Course

STEP = 1e-3  # s, of the grid
# What counts as kept: rounding, and no more.
SPEED, ACCELERATION, JERK, PLACE = 1e-6, 1e-6, 1e-6, 1e-6  # m/s, m/s², m/s³, m


class Violation(NamedTuple):
    """The worst of what a curve violates: what, when (s), where (m), its value and the bound."""

    what: str
    time: float
    position: float
    value: float
    bound: float

    def __str__(self) -> str:
        return (
            f"{self.what} {self.value:.6g} beyond {self.bound:.6g} at {self.time:.3f} s, "
            f"{self.position:.2f} m"
        )


def violations(curve: SpeedCurve, course: Course) -> tuple[Violation, ...]:
    """Return the worst violation of each kind, on a grid of 1 ms and at all knots."""
    grid = np.arange(0.0, curve.running_time, STEP)
    at = curve.at(np.union1d(grid, curve.time))
    span = np.searchsorted(curve.time, at.time, side="right") - 1
    jerk = curve.jerk[np.clip(span, 0, len(curve.regimes) - 1)]
    driving = course.driving
    pull = at.acceleration + course.resistance(at.speed, at.position)
    flat = np.ones_like(at.time)
    checks = (
        ("speed", at.speed, course.lowest_limits(at.position), SPEED),
        ("backward speed", -at.speed, 0.0 * flat, SPEED),
        ("jerk", np.abs(jerk), driving.jerk * flat, JERK),
        ("deceleration", -at.acceleration, driving.deceleration * flat, ACCELERATION),
        ("traction", pull, course.traction(at.speed), ACCELERATION),
    )
    found = []
    for what, values, bounds, tolerance in checks:
        worst = int(np.argmax(values - bounds))
        if values[worst] - bounds[worst] > tolerance:
            place = (float(at.time[worst]), float(at.position[worst]))
            found.append(Violation(what, *place, float(values[worst]), float(bounds[worst])))
    end = (curve.running_time, curve.length)
    if abs(curve.length - course.section.length) > PLACE:
        found.append(Violation("position of the stop", *end, curve.length, course.section.length))
    if abs(curve.speed[-1]) > SPEED:
        found.append(Violation("speed at the stop", *end, float(curve.speed[-1]), 0.0))
    if -curve.acceleration[-1] > driving.final_deceleration + ACCELERATION:
        last = float(-curve.acceleration[-1])
        found.append(Violation("final deceleration", *end, last, driving.final_deceleration))
    return tuple(found)
