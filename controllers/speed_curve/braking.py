"""Braking with bounded jerk, in closed form."""

import math
from typing import NamedTuple


class Ramp(NamedTuple):
    """A span of constant jerk: how long (s), and the jerk (m/s³)."""

    duration: float
    jerk: float


class Braking(NamedTuple):
    """From a state to a goal's speed: the spans, and the way (m) that they take."""

    ramps: tuple[Ramp, ...]
    distance: float


def braking(
    speed: float, acceleration: float, goal: float, *, jerk: float, deceleration: float,
    final: float = 0.0,
) -> Braking | None:  # fmt: skip
    """Return the quickest way down from a speed (m/s) and acceleration (m/s²) to a goal's speed.

    The acceleration falls with the jerk (m/s³) to −deceleration, or as far as it takes, stays
    there, and rises to −final (m/s², not negative) where the goal is reached. None if the goal lies
    above what the train has when its acceleration is merely taken back, or too little below for
    the final deceleration.
    """
    fall = speed - goal
    peak = (acceleration * acceleration + final * final) / 2.0 + jerk * fall
    least = max(-acceleration, final)
    if peak < least * least or (acceleration > 0.0 and peak < 0.0):
        return None
    lowest = min(math.sqrt(peak), deceleration)
    if lowest < least:
        return None
    hold = 0.0
    if peak > deceleration * deceleration:
        hold = (peak / jerk - deceleration * deceleration / jerk) / deceleration
    ramps = (
        Ramp((acceleration + lowest) / jerk, -jerk),
        Ramp(hold, 0.0),
        Ramp((lowest - final) / jerk, jerk),
    )
    distance, v, a = 0.0, speed, acceleration
    for time, rate in ramps:
        distance += time * (v + time * (a / 2.0 + time * rate / 6.0))
        v += time * (a + time * rate / 2.0)
        a += time * rate
    return Braking(ramps, distance)
