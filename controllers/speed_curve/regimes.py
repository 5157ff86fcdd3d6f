"""Which regime a span of a curve belongs to, told from the force that it takes."""

import numpy as np

from .curve import Regime
from .driving import Course

FULL, NONE = 0.95, 0.03  # shares of the traction's envelope
SHORTEST = 2.5  # s; what is shorter belongs to its neighbour


def regimes(
    course: Course,
    time: np.ndarray,
    position: np.ndarray,
    speed: np.ndarray,
    acceleration: np.ndarray,
) -> tuple[Regime, ...]:
    """Return the regime of each span between knots.

    Traction is nearly all that the envelope gives, coasting nearly no force, braking a force
    below that; any other traction is "cruise". A ramp from one to another belongs to what follows.
    """
    middle = [(q[:-1] + q[1:]) / 2.0 for q in (position, speed, acceleration)]
    pull = middle[2] + course.resistance(middle[1], middle[0])
    share = pull / course.traction(middle[1])
    found: list[Regime] = [
        "traction" if x > FULL else "cruise" if x > NONE else "coast" if x > -NONE else "brake"
        for x in share.tolist()
    ]
    starts = [k for k in range(len(found)) if k == 0 or found[k] != found[k - 1]]
    following: Regime = found[-1]
    for start, end in reversed(list(zip(starts, [*starts[1:], len(found)], strict=True))):
        if end < len(found) and time[end] - time[start] < SHORTEST:
            for k in range(start, end):
                found[k] = following
        following = found[start]
    return tuple(found)
