"""A drive along a course, span by span: full traction or coasting, the limits, the goals."""

import math
from collections.abc import Callable
from itertools import pairwise

from ...base.errors import ParameterError
from ...base.railway import GRAVITY_PER_MILLE
from .braking import Ramp
from .curve import Regime
from .driving import Course
from .goals import Goal, goals
from .root import root
from .run import Run

SPAN, LONG = 0.1, 0.5  # s, of traction; of holding a speed and coasting
BELOW_ENVELOPE = 1.0 - 2e-4  # so that the chords of a span stay below the traction's envelope
TIE = 1e-9  # m, m/s and m/s²
SLOWEST = 1.0  # m/s: what coasts is not let below

Tests = list[tuple[Callable[[float], float], Goal | None]]


class Drive:
    """One drive from standstill to the stop, with full traction up to the limits or `cruise` (m/s).

    From `coast_from` (m) on it coasts. Each span has a constant jerk and ends where something
    happens: a limit is come up to or ends, a goal calls for braking, coasting begins.
    """

    def __init__(self, course: Course, *, cruise: float, coast_from: float):
        self.course, self.driving = course, course.driving
        self.limits = [(p, min(v, cruise)) for p, v in course.limits]
        self.rises = [p for (_, a), (p, b) in pairwise(self.limits) if b > a]
        self.goals = goals(self.limits, course.section.length, course.driving)
        self.coast_from = coast_from
        self.run = Run()

    def to_stop(self) -> Run:
        """Drive. Raise ParameterError where the stop is not reached."""
        while self.goals:
            goal = self._step()
            if goal is not None:
                self._brake(goal)
        return self.run

    @property
    def _limit(self) -> float:
        return [v for p, v in self.limits if p <= self.run.position + TIE][-1]

    @property
    def _coasts(self) -> bool:
        return self.run.position >= self.coast_from - TIE

    def _step(self) -> Goal | None:
        """Drive one span, or up to the first thing that happens; return the goal to brake for."""
        run, limit = self.run, self._limit
        tests: Tests = []
        if self._holds(limit):
            ramp, regime = Ramp(LONG, 0.0), "cruise"
        elif run.acceleration > 0.0 and self._above(limit, Ramp(0.0, 0.0)) >= -TIE:
            ramp, regime = Ramp(run.acceleration / self.driving.jerk, -self.driving.jerk), "cruise"
        else:
            ramp, regime = self._pulled(limit), "coast" if self._coasts else "traction"
            if run.acceleration > 0.0 or ramp.jerk > 0.0:
                tests.append((lambda t: self._above(limit, Ramp(t, ramp.jerk)), None))
        tests += self._places(ramp.jerk)
        tests += [(lambda t, g=g: g.overrun(*run.ahead(t, ramp.jerk)), g) for g in self.goals]
        duration, met = first(tests, ramp.duration)
        run.add(duration, ramp.jerk, regime)
        if ramp.jerk < 0.0 and regime == "cruise" and abs(run.acceleration) < TIE:
            run.settle(speed=limit)
        if met is None:
            self._refuse_halt(regime)
        return met

    def _holds(self, limit: float) -> bool:
        """Tell whether the train is at the limit and is to stay there."""
        run = self.run
        if abs(run.speed - limit) > TIE or abs(run.acceleration) > TIE:
            return False
        ends = run.position, run.position + LONG * run.speed
        most = 0.0 if self._coasts else self.course.traction(run.speed)
        return all(self.course.resistance(run.speed, s) <= most for s in ends)

    def _above(self, limit: float, after: Ramp) -> float:
        """Return how far (m/s) taking the acceleration back after a ramp leads above a limit."""
        _, v, a = self.run.ahead(after.duration, after.jerk)
        return v + max(a, 0.0) ** 2 / (2.0 * self.driving.jerk) - limit

    def _places(self, jerk: float) -> Tests:
        """Return the tests for the places ahead where another rule begins to hold."""
        run = self.run
        places = [p for p in (*self.rises, self.coast_from) if run.position + TIE < p < math.inf]
        return [(lambda t, p=p: run.ahead(t, jerk)[0] - p, None) for p in places]

    def _pulled(self, limit: float) -> Ramp:
        """Return the span in which traction follows its envelope, or the train coasts.

        Its end is on the wanted acceleration as far as the jerk lets it, and at the limit does not
        lead beyond. It ends where the gradient begins to change, or ends to.
        """
        run, course = self.run, self.course
        span = LONG if self._coasts else SPAN
        for kink in course.kinks:
            if run.position + TIE < kink < run.ahead(span, 0.0)[0]:
                span = root(lambda t, k=kink: run.ahead(t, 0.0)[0] - k, 0.0, span, tolerance=1e-14)
                break
        reach = self.driving.jerk * span
        wanted = run.acceleration
        for _ in range(4):  # the end's speed and place depend on it, weakly
            s, v, _ = run.ahead(span, (wanted - run.acceleration) / span)
            pull = 0.0 if self._coasts else course.traction(v) * BELOW_ENVELOPE
            goal = pull - course.resistance(v, s)
            goal = min(goal, 0.0) if run.speed > limit - TIE else goal
            wanted = min(max(goal, run.acceleration - reach), run.acceleration + reach)
        return Ramp(span, (wanted - run.acceleration) / span)

    def _brake(self, goal: Goal) -> None:
        """Brake to the goal; it and those before it are done with."""
        run = self.run
        way = goal.braking(run.speed, run.acceleration)
        for ramp in way.ramps if way else ():
            run.add(ramp.duration, ramp.jerk, "brake")
        beyond = run.position - goal.position
        if goal is self.goals[-1] and beyond > 1e-6:
            raise ParameterError(
                f"section '{self.course.section.name}': its {goal.position:g} m are too short; to "
                f"depart and stop under a jerk of {self.driving.jerk:g} m/s³ takes "
                f"{run.position:.3f} m"
            )
        place = goal.position if abs(beyond) < 1e-6 else None
        run.settle(position=place, speed=goal.speed, acceleration=-goal.final)
        self.goals = [g for g in self.goals if g.position > goal.position]

    def _refuse_halt(self, regime: Regime) -> None:
        run, slowest = self.run, SLOWEST if regime == "coast" else 0.0
        if run.speed <= slowest and run.acceleration <= 0.0:
            steep = self.course.resistance(run.speed, run.position) / GRAVITY_PER_MILLE
            raise ParameterError(
                f"section '{self.course.section.name}': under {regime} the train halts at "
                f"{max(run.position, 0.0):.0f} m of {self.course.section.length:g} m; resistance "
                f"and gradient are {steep:.1f} ‰ of its weight there"
            )


def first(tests: Tests, duration: float) -> tuple[float, Goal | None]:
    """Return when within a duration (s) the first test comes to 0 from below, and its goal."""
    met = None
    for test, goal in tests:
        if test(duration) >= 0.0:
            duration = root(test, 0.0, duration, tolerance=1e-14) if test(0.0) < 0.0 else 0.0
            met = goal
    return duration, met
