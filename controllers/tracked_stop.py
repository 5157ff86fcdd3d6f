"""A stop on a target curve: a control law, and what it is told about now and later."""

from dataclasses import dataclass, field
from typing import Any

from ..cosim.block import Block, require, require_finite, require_positive
from .brake_model import BrakeModel
from .braking_profile import BrakingProfile
from .delay_predictor import DelayPredictor
from .stop_command import StopCommand


@dataclass(frozen=True, kw_only=True, slots=True)
class TrackedStop(Block):
    """Follows a `profile` to a stop by a `law`: SMARC, SlidingMode, SpeedPID, PositionPID.

    Three loop modes. By itself the law sees the errors of now, whatever the delays (m0, the
    precise braking paper's). With a `shift` (s) the feed-forward is that of so much later (m1).
    With a `predictor` all errors, and the feed-forward, are those at the predictor's horizon
    (m2); what disturbance it reports is added to the resistance, by `compensation`.
    The last stage is `StopCommand`. Time is counted in samples from the run's start.
    """

    law: Block
    profile: BrakingProfile = field(default_factory=BrakingProfile)
    model: BrakeModel = field(default_factory=BrakeModel)
    predictor: DelayPredictor | None = None
    shift: float = 0.0
    compensation: float = 1.0
    limiter: StopCommand = field(default_factory=StopCommand)
    period: float = 0.2

    inputs = {"position": "m", "speed": "m/s"}
    outputs = {"command": "m/s2"}

    def __post_init__(self) -> None:
        require_positive(self, "period")
        require_finite(self, "shift", "compensation")
        for part in (self.law, self.profile, self.predictor, self.limiter):
            same = part is None or part.period == self.period
            require(self, same, f"all parts must have its period, {self.period!r} s")

    def start(self) -> tuple[Any, ...]:
        """Return (the sample's number, states of predictor, law and limiter)."""
        predictor = () if self.predictor is None else self.predictor.start()
        return 0.0, predictor, self.law.start(), self.limiter.start()

    def step(self, x: Any, position: Any, speed: Any) -> tuple[Any, Any]:
        """Return (command in m/s², next state)."""
        count, ahead, law, last = x
        t, now, profile = count * self.period, speed, self.profile
        shift, disturbance = self.shift, 0.0
        if self.predictor is not None:
            found, ahead = self.predictor.step(ahead, position, speed, last)
            position, speed, horizon, now, disturbance = found
            t = t + horizon
        target, target_speed, acceleration = profile.at(t)
        if type(shift) is not float or shift:  # else the law takes the targets of now
            _, _, acceleration = profile.at(t + shift)
        resistance = self.model.resistance(position, speed) - self.compensation * disturbance
        y, law = self.law.step(
            law,
            position - target,
            speed - target_speed,
            acceleration,
            resistance,
        )
        wanted = y[0] if isinstance(y, tuple) else y
        command, last = self.limiter.step(last, wanted, now)
        return command, (count + 1.0, ahead, law, last)
