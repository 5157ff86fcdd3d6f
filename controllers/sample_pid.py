"""PID control per sample, of a coupler's force, within what the locomotives can give."""

import math
from dataclasses import dataclass, field
from typing import Any

from ..base.ops import clip, finite, is_symbol, where
from ..base.units import parse
from ..cosim.block import Block, Ports, require, require_finite, require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class SamplePID(Block):
    """u = scale · (kp e + ki Σe + kd δ), e = reference − measurement, δ = e(k) − e(k−1).

    The gains are those of the heavy-haul paper, per sample of its 2 ms: ki = 0.003 is 1.5 1/s. Its
    eq. 11 is lost; this is the usual form. e(−1) is e(0), so that no step at the start kicks.

    - `unit` is that of reference and measurement, `scale` (N per `unit`) makes the output `force`
      one: 1 for the error of a force. For a speed it is ours to choose.
    - With `feed_forward` a fourth input of that name (N) is added.
    - `filter_time` (s): δ through a first-order filter, backward Euler; 0: none (ours).
    - The force changes by no more than `rate` (N/s; inf: no limit) from one sample to the next,
      beginning at 0 N, and lies within the inputs `lower` and `upper` (N), which go before the
      rate: what the locomotives can give now (2 MN/s and the limits are ours).
    - `anti_windup` (ours): where the force asked for lies beyond `lower` or `upper`, the sample
      adds nothing to the sum if that would push further beyond. The rate counts for nothing
      here: noise reaches it at every other sample, and would stop the integral.
    """

    kp: float = 0.8
    ki: float = 0.003
    kd: float = 4.0
    scale: float = 1.0
    unit: str = "N"
    filter_time: float = 0.0
    rate: float = 2e6
    anti_windup: bool = True
    feed_forward: bool = False
    period: float = 0.002
    inputs: Ports = field(init=False, repr=False, compare=False)

    outputs = {"force": "N"}

    def __post_init__(self) -> None:
        require_finite(self, "kp", "ki", "kd")
        require_positive(self, "scale", "period")
        good = is_symbol(self.filter_time) or (finite(self.filter_time) and self.filter_time >= 0.0)
        require(self, good, f"filter_time must be a time from 0 s, not {self.filter_time!r}")
        good = is_symbol(self.rate) or (isinstance(self.rate, int | float) and self.rate > 0.0)
        require(self, good, f"rate must be in N/s, or inf for no limit, not {self.rate!r}")
        parse(self.unit)
        ports = {"reference": self.unit, "measurement": self.unit, "upper": "N", "lower": "N"}
        if self.feed_forward:
            ports["feed_forward"] = "N"
        object.__setattr__(self, "inputs", ports)

    def gains(self, e: Any, change: Any) -> tuple[Any, Any, Any]:
        """Return (kp, ki, kd) at an error and its change per sample, both in `unit`."""
        return self.kp, self.ki, self.kd

    def start(self) -> tuple[float, float, float, float, float]:
        """Return (ki Σe, δ, last e, last force, whether the next sample is the first)."""
        return 0.0, 0.0, 0.0, 0.0, 1.0

    def step(
        self, x: Any, reference: Any, measurement: Any, upper: Any, lower: Any,
        feed_forward: Any = 0.0,
    ) -> tuple[Any, Any]:  # fmt: skip
        """Return (force, next state)."""
        force, _, following = self._sample(x, reference - measurement, upper, lower, feed_forward)
        return force, following

    def _sample(
        self, x: Any, e: Any, upper: Any, lower: Any, feed_forward: Any
    ) -> tuple[Any, tuple[Any, Any, Any], Any]:
        total, change, last, last_force, first = x
        span = self.filter_time + self.period
        new = self.period / span * (e - where(first > 0.5, e, last))
        change = self.filter_time / span * change + new
        kp, ki, kd = gains = self.gains(e, change)
        grown, integral = self._integrated(total, ki, e)
        wanted = self.scale * (kp * e + integral + kd * change) + feed_forward
        if self.anti_windup:
            beyond = wanted - clip(wanted, lower, upper)
            grown = where(beyond * (ki * e) > 0.0, total, grown)
        force = wanted
        if is_symbol(self.rate) or self.rate < math.inf:
            most = self.rate * self.period
            force = clip(wanted, last_force - most, last_force + most)
        force = clip(force, lower, upper)
        return force, gains, (grown, change, e, force, 0.0)

    def _integrated(self, total: Any, ki: Any, e: Any) -> tuple[Any, Any]:
        """Return (what is summed, the integral part of u in `unit`) with this sample's error."""
        grown = total + ki * e
        return grown, grown
