"""The goals of a run: places at which a speed has to be reached, the last of them the stop."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from .braking import Braking, braking
from .driving import Driving
from .root import root


@dataclass(frozen=True)
class Goal:
    """At `position` (m) the train must have come down to `speed` (m/s)."""

    position: float
    speed: float
    final: float  # m/s², the deceleration left there
    driving: Driving

    def braking(self, speed: float, acceleration: float) -> Braking | None:
        """Return the way down to the goal's speed, None if there is none to go."""
        return braking(
            speed, acceleration, self.speed, jerk=self.driving.jerk,
            deceleration=self.driving.deceleration, final=self.final,
        )  # fmt: skip

    def overrun(self, position: float, speed: float, acceleration: float) -> float:
        """Return how far (m) behind the goal its speed is reached when braking begins here."""
        way = self.braking(speed, acceleration)
        return -math.inf if way is None else position + way.distance - self.position


def goals(limits: Sequence[tuple[float, float]], stop: float, driving: Driving) -> list[Goal]:
    """Return the goals: where limits (position, m/s) fall, and the stop (m).

    Where a limit is so short that braking for the next one has to begin within it at once, its
    own goal is lowered as far as the next one needs.
    """
    found = [Goal(stop, 0.0, driving.final_deceleration, driving)]
    falls = [(p, b) for (_, a), (p, b) in pairwise(limits) if b < a]
    for position, speed in reversed(falls):
        later = found[0]
        goal = Goal(position, speed, 0.0, driving)
        if later.overrun(position, speed, 0.0) > 0.0:
            least = max(later.speed, 1e-3)

            def over(v: float, later: Goal = later, position: float = position) -> float:
                return max(later.overrun(position, v, 0.0), position - later.position)

            goal = Goal(position, root(over, least, speed, tolerance=1e-12), 0.0, driving)
        found.insert(0, goal)
    return found
