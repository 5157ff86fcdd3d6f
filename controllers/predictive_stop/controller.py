"""The predictive stop: estimate, predict where the train will stand, move the brake level."""

import math
from dataclasses import dataclass, field
from typing import Any

from ...cosim.block import Block, require, require_finite, require_positive
from .braking_model import BrakingModel, Plan, Samples
from .prior import INDEX, PARAMETERS, Prior

ASLEEP, WATCHING, BRAKING, STANDING = range(4)
SETTLING = 10  # samples at standstill that the estimate still takes in
_MOST = 900  # samples; a train that is on its way for longer keeps its command


@dataclass(frozen=True, kw_only=True, slots=True)
class PredictiveStop(Block):
    """Stop at the mark (position 0) by prediction, with parameters estimated on the way.

    Inputs are the measured position and speed. Each `period` the estimate θ̂ takes in the sample
    by one step of Gauss–Newton over all samples since some `watch` s before braking (not with a
    speed below `estimate_above`, m/s). Then the stop S(L) is predicted for a command that goes at
    the model's `rate` to a level L and stays there, or at low speeds to a share of it (`plan`).
    Braking begins when S(L_set) + v̂ · period/2 ≥ aim, L_set being the level that gives the
    deceleration `braking` with resistance. From then on `iterations` times a period
    L ← L − (S − aim) S'/(S'² + damping²), the command within `limits`: where a change of level
    moves the stop by less than `damping` (m per m/s²), the level is left alone. At standstill the
    command is `holding`. Until the watch begins the command is that which should hold the speed;
    it must have done so for long enough that the motors are in equilibrium.

    The plan's `ending` below 1 softens the last metres: the level's share falls to it from the
    speed `fast` to `slow`. That gives the control time to see and correct what the air brake does.
    Its upper limit stays below 0.1 m/s², where the train would release its air brake.

    A `probe` of the model is for the variant that sends it, ProbingStop.

    Outputs: command; predicted_stop (m); level L (m/s²); phase (0 before, 1 watching, 2 braking,
    3 standing), and the estimates. All of it is our choice. Raise ParameterError for wrong numbers.
    """

    prior: Prior
    model: BrakingModel = field(default_factory=BrakingModel)
    plan: Plan = field(default_factory=Plan)
    braking: float = 0.70
    iterations: int = 2
    watch: float = 4.0
    estimate_above: float = -1.0
    holding: float = -0.5
    period: float = 0.2

    inputs = {"position": "m", "speed": "m/s"}
    outputs = {
        "command": "m/s2",
        "predicted_stop": "m",
        "level": "m/s2",
        "phase": "1",
        **PARAMETERS,
    }

    def __post_init__(self) -> None:
        require_positive(self, "braking", "watch", "period")
        require_finite(self, "holding")
        plan = self.plan
        good = plan.damping > 0.0 and plan.limits[0] < plan.limits[1]
        require(self, good, f"plan must have damping > 0 and limits (low, high), not {plan!r}")
        good = plan.ending > 0.0 and plan.slow < plan.fast
        require(self, good, f"plan must have ending > 0 and slow < fast, not {plan!r}")
        good = self.period == self.model.period
        require(self, good, f"period must be the model's, {self.model.period!r} s")
        require(self, self.iterations >= 1, f"iterations begin at 1, not {self.iterations!r}")

    def start(self) -> Any:
        """Return (phase, level, last command, stop, samples at standstill, when a probe begins (s
        since the first sample), θ̂, samples)."""
        return ASLEEP, 0.0, 0.0, 0.0, 0, math.inf, self.prior.mean, ((), (), ())

    def step(self, x: Any, position: Any, speed: Any) -> tuple[Any, Any]:
        """Return ((command, predicted stop, level, phase, estimates …), next state)."""
        phase, level, last, stop, stood, probed, theta, samples = x
        if phase == ASLEEP:
            level = last = self._cruising(speed)
            if position >= -self._distance(speed):
                phase, theta = WATCHING, self.prior.starting(speed, position).mean
        if phase != ASLEEP and stood < SETTLING and len(samples[0]) < _MOST:
            positions, speeds, commands = samples
            if phase == WATCHING:  # a probe follows when braking begins: now, if it does so now
                probed = self._first_probe(len(commands))
            seen = Samples((*positions, position), (*speeds, speed), commands, probed)
            theta, phase, level, stop, last = self._decided(phase, level, stop, last, theta, seen)
            samples = (seen.positions, seen.speeds, (*commands, last))
            stood += phase == STANDING
        if stood >= SETTLING:
            last = self.holding
        return (last, stop, level, phase, *theta), (
            phase, level, last, stop, stood, probed, theta, samples,
        )  # fmt: skip

    def _decided(
        self, phase: int, level: float, stop: float, last: float, theta: Any, seen: Samples
    ) -> tuple[Any, int, float, float, float]:
        """Return (θ̂, phase, level, predicted stop, command) after a sample."""
        prior = self.prior.starting(theta[INDEX["speed"]], theta[INDEX["position"]])
        if seen.speeds[-1] > self.estimate_above:
            theta = self.model.estimate(theta, seen, prior).theta
        if phase == WATCHING:
            level = self.first_level(theta)
            found = self.model.plan(
                theta, seen.commands, last, level, self.plan, probed=seen.probed
            )
            stop = found.stop
            if stop - self.plan.aim + 0.5 * self.period * found.speed >= 0.0:
                phase = BRAKING
        if phase == BRAKING:
            found = self.model.plan(
                theta, seen.commands, last, level, self.plan, iterations=self.iterations,
                probed=seen.probed,
            )  # fmt: skip
            level, stop, last = found.level, found.stop, found.command
            if found.speed == 0.0 and abs(seen.speeds[-1]) < 0.1:
                phase = STANDING
        return theta, phase, level, stop, self.holding if phase == STANDING else last

    def first_level(self, theta: Any) -> float:
        """Return L_set: −(braking − r̂)/ĝ, the resistance being that at 0.6 of the speed."""
        gradient = 0.5 * (theta[INDEX["approach"]] + theta[INDEX["platform"]])
        v = 0.6 * theta[INDEX["speed"]]
        r = theta[INDEX["davis"]] * self.model.running_resistance(v) + gradient
        return -(self.braking - r) / theta[INDEX["electric_gain"]]

    def _first_probe(self, ticks: int) -> float:
        """Return when a probe begins (s), with braking that begins after so many commands."""
        probe = self.model.probe
        return (
            math.inf if probe is None else (ticks + round(probe.after / self.period)) * self.period
        )

    def _cruising(self, speed: float) -> float:
        """Return the command that should hold a speed on the approach."""
        r = self.prior["davis"] * self.model.running_resistance(speed) + self.prior["approach"]
        return r / self.prior["electric_gain"]

    def _distance(self, speed: float) -> float:
        """Return how far before the mark the watch begins."""
        lag = self.prior["electric_delay"] + self.prior["electric_lag"]
        ramp = 0.5 * self.braking / self.model.rate * self.period
        soft = self.plan.fast * (1.0 / self.plan.ending - 1.0) / self.braking
        return speed * (speed / (2.0 * self.braking) + lag + ramp + self.watch) + soft
