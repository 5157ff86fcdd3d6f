"""Automatic train operation: it drives a metro train along a target speed curve to its mark."""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Self

from ..cosim.block import Block, require, require_finite, require_limits, require_positive
from .speed_curve.curve import SpeedCurve
from .speed_curve.driving import Course
from .speed_curve.feed_forward import Response, feed_forward

DISTURBANCE = 0.15  # share of a sample's deviation that the estimated disturbance takes in
MOST_DISTURBANCE = 0.15  # m/s²
SLOW = 1.5  # m/s; below, the deviation tells nothing new about the disturbance
SLOWEST, ENDING = 1.0, -0.15  # m/s; m/s²: below it, the command brakes at least so much
STANDING = 0.01  # m/s
NOMINAL = Response()


@dataclass(frozen=True, kw_only=True, eq=False)
class ATO(Block):
    """Command (m/s²) along a curve: feed-forward, and feedback of what deviates from the curve.

    `feed_forward` has the commands for the known train, one each `period` (s) from the first
    sample on; the curve's departure is `lead` (s) later, as a command takes its time. Deviations of
    position and speed are predicted over the motors' delay with the corrections under way, and fed
    back such that the motors' lag, speed and position have a triple pole at −`bandwidth` (1/s). A
    disturbance (m/s²), estimated from how the speed deviates from its prediction, is
    compensated. The motors' delay is at least a period.

    Up to the last braking the reference is the curve at the time. In the last braking it is the
    curve at the train's position: what counts then is the place, and a late train stops at its
    mark, late. At standstill there the command is `holding`. All our choice; the paper's
    controllers follow a curve in the same two ways (precise braking paper, section 4).
    Raise ParameterError for wrong numbers.
    """

    curve: SpeedCurve
    feed_forward: tuple[float, ...]
    response: Response = NOMINAL
    lead: float = 2.0
    bandwidth: float = 0.5
    limits: tuple[float, float] = (-1.0, 1.5)
    holding: float = -0.5
    period: float = 0.2

    inputs = {"position": "m", "speed": "m/s"}
    outputs = {"command": "m/s2", "target": "m/s"}

    def __post_init__(self) -> None:
        require(self, isinstance(self.curve, SpeedCurve), "curve must be a SpeedCurve")
        require_positive(self, "period", "bandwidth")
        require_finite(self, "lead", "holding")
        require(self, self.lead >= 0.0, f"lead must not be negative, is {self.lead!r} s")
        require(self, self.holding < 0.0, f"holding must brake (< 0), is {self.holding!r} m/s2")
        require(self, len(self.feed_forward) > 0, "feed_forward needs a command at least")
        require_limits(self)

    @classmethod
    def along(
        cls, curve: SpeedCurve, course: Course, *, response: Response | None = None, **options: Any
    ) -> Self:
        """Return an ATO along a curve for a train that answers as `response` says.

        `options` are the block's other fields.
        """
        bare = cls(curve=curve, feed_forward=(0.0,), response=response or NOMINAL, **options)
        commands = feed_forward(
            curve, course, bare.response, lead=bare.lead, period=bare.period, limits=bare.limits
        )
        return cls(curve=curve, feed_forward=commands, response=bare.response, **options)

    @cached_property
    def braking_from(self) -> float:
        """The position (m) from which on the reference is the curve at the train's place."""
        return float(self.curve.at(self.curve.phases()[-1].start).position)

    def start(self) -> tuple[Any, ...]:
        """Return (samples, corrections under way, motors' deviation, prediction, disturbance).

        The prediction is that of the speed's deviation, and whether there is one (0 or 1).
        """
        pending = math.ceil(self.response.electric_delay / self.period) + 1
        return 0, (0.0,) * pending, 0.0, (0.0, 0), 0.0

    def step(self, x: Any, position: Any, speed: Any) -> tuple[Any, Any]:
        """Return ((command, the curve's speed), next state)."""
        count, corrections, motors, (predicted, known), disturbance = x
        at_place = position >= self.braking_from
        now = self.period * count - self.lead
        target = self.curve.at_position(position) if at_place else self.curve.at(now)
        late = 0.0 if at_place else position - float(target.position)
        deviation = speed - float(target.speed)
        if speed > SLOW and known:
            new = disturbance + DISTURBANCE * (deviation - predicted) / self.period
            disturbance = min(max(new, -MOST_DISTURBANCE), MOST_DISTURBANCE)

        sample = (float(target.time) + self.lead) / self.period if at_place else count
        base = self._base(sample)
        wanted = base + self._correction(corrections, motors, late, deviation, disturbance)
        most = self.limits[1]
        if at_place and speed <= self.response.changeover_speed:
            most = 0.0 if speed > SLOWEST else ENDING  # the air brake is not to be released
        command = min(max(wanted, self.limits[0]), most)
        if now > 0.0 and speed < STANDING and at_place:
            command = self.holding
        # Where the reference changes over, the deviations before and after are not to be compared.
        crosses = at_place != (position + speed * self.period >= self.braking_from)
        motors, risen, _ = self._ahead(corrections, motors, self.period)
        following = deviation + risen + self.period * disturbance, 0 if crosses else 1
        corrections = (command - base, *corrections[:-1])
        state = (count + 1, corrections, motors, following, disturbance)
        return (command, float(target.speed)), state

    def _base(self, sample: float) -> float:
        """Return the feed-forward at a sample, or between two."""
        last = len(self.feed_forward) - 1
        sample = min(max(sample, 0.0), float(last))
        k = min(int(sample), last)
        later = self.feed_forward[min(k + 1, last)]
        return self.feed_forward[k] + (sample - k) * (later - self.feed_forward[k])

    def _correction(
        self, under_way: tuple[float, ...], motors: float, late: float, deviation: float,
        disturbance: float,
    ) -> float:  # fmt: skip
        """Return what to add to the feed-forward (m/s²)."""
        delay, lag = self.response.electric_delay, self.response.electric_lag
        motors, risen, way = self._ahead(under_way, motors, delay)
        late = late + delay * deviation + way + delay * delay / 2.0 * disturbance
        deviation = deviation + risen + delay * disturbance
        w = self.bandwidth
        excess = motors + disturbance  # over what balances the disturbance
        feedback = w * w * (w * late + 3.0 * deviation) * lag + (3.0 * w * lag - 1.0) * excess
        return -(feedback + disturbance) / self.response.electric_coefficient

    def _ahead(
        self, under_way: tuple[float, ...], motors: float, time: float
    ) -> tuple[float, float, float]:
        """Return the motors' deviation, and what it adds to speed and position within a time (s).

        `under_way` has the corrections given at the samples before, the newest first.
        """
        response = self.response
        speed = way = 0.0
        # The correction given j samples ago acts from delay − j periods on, for a period.
        starts = [response.electric_delay - j * self.period for j in range(len(under_way), 0, -1)]
        edges = [min(max(s, 0.0), time) for s in (*starts, starts[-1] + self.period)]
        for (begin, end), correction in zip(pairwise(edges), reversed(under_way), strict=True):
            span = end - begin
            goal = response.electric_coefficient * correction
            faded = -math.expm1(-span / response.electric_lag)
            risen = goal * span + (motors - goal) * response.electric_lag * faded
            rest = (motors - goal) * response.electric_lag
            way += span * (speed + goal * span / 2.0)
            way += rest * (span - response.electric_lag * faded)
            speed += risen
            motors += (goal - motors) * faded
        return motors, speed, way
