"""Single-neuron adaptive PID control of speed, with fixed or self-tuned gain."""

from dataclasses import dataclass
from typing import Any, Self

from ..base.ops import absolute, clip, maximum, where
from ..cosim.block import Block, require_finite, require_limits, require_positive
from .error_rate import Rate, error_rate, require_rate
from .fuzzy import Mamdani
from .rules import GAIN_RULES

_LEAST_GAIN = 0.01  # K > 0 is the paper's condition


@dataclass(frozen=True, kw_only=True, slots=True)
class SingleNeuron(Block):
    """u(k) = u(k−1) + increment_gain · K Σ w'_i x_i, limited (soft-switching paper, eq. 1 to 8).

    x are the integral, proportional and derivative increments of e: e, Δe, Δ²e, and with
    `scaled` period · e, Δe, Δ²e / period, so that they mean the same at any period. The weights
    learn by w_i += eta_i · e · u(k−1) · (e + Δe) before they are used (with u(k) on the right,
    as printed, the equation would be implicit), are floored at `floor` (None: not at all) and
    normalised by Σ|w|. K = k0, plus the output of `gain_rules` (table 2) for e and its rate.
    `limits`, the first weights `w0` and the floor are ours. The output `gain` is K.
    """

    k0: float = 0.9
    eta_i: float = 7.5
    eta_p: float = 18.2
    eta_d: float = 12.0
    increment_gain: float = 5.0
    gain_rules: Mamdani | None = GAIN_RULES
    scaled: bool = True
    rate: Rate = "derivative"
    w0: float = 0.1
    floor: float | None = 0.1
    limits: tuple[float, float] = (-10.0, 10.0)
    kick: bool = False
    period: float = 0.05

    inputs = {"reference": "m/s", "measurement": "m/s"}
    outputs = {"u": "1", "gain": "1"}

    def __post_init__(self) -> None:
        require_finite(self, "eta_i", "eta_p", "eta_d")
        require_positive(self, "k0", "increment_gain", "w0", "period")
        if self.floor is not None:
            require_positive(self, "floor")
        require_limits(self)
        require_rate(self, self.rate)

    @classmethod
    def recommended(cls, **options: Any) -> Self:
        """Return our reading of the paper: scaled increments, floored weights, 0.05 s."""
        return cls(**options)

    @classmethod
    def literal(cls, **options: Any) -> Self:
        """Return the paper to the letter: plain increments, no floor, memories that start at 0."""
        values: dict[str, Any] = {
            "increment_gain": 1.0,
            "scaled": False,
            "rate": "difference",
            "floor": None,
            "kick": True,
        }
        return cls(**values, **options)

    def start(self) -> tuple[Any, ...]:
        """Return (u, e(k−1), e(k−2), the three weights, whether the next sample is the first)."""
        w0 = self.w0
        return 0.0, 0.0, 0.0, (w0, w0, w0), 0.0 if self.kick else 1.0

    def step(self, x: Any, reference: Any, measurement: Any) -> tuple[Any, Any]:
        """Return ((u, gain), next state)."""
        last_u, e1, e2, weights, first = x
        e = reference - measurement
        e1, e2 = where(first > 0.5, e, e1), where(first > 0.5, e, e2)
        change = e - e1
        bend = e - 2.0 * e1 + e2
        learn = e * last_u * (e + change)
        w_i, w_p, w_d = (
            self._floored(w + eta * learn)
            for w, eta in zip(weights, (self.eta_i, self.eta_p, self.eta_d), strict=True)
        )
        total = absolute(w_i) + absolute(w_p) + absolute(w_d)
        x_i, x_d = (self.period * e, bend / self.period) if self.scaled else (e, bend)
        increment = (w_i * x_i + w_p * change + w_d * x_d) / total
        gain = self._gain(e, change)
        u = clip(last_u + self.increment_gain * gain * increment, *self.limits)
        return (u, gain), (u, e, e1, (w_i, w_p, w_d), 0.0)

    def _floored(self, weight: Any) -> Any:
        return weight if self.floor is None else maximum(weight, self.floor)

    def _gain(self, e: Any, change: Any) -> Any:
        if self.gain_rules is None:
            return self.k0
        ec = error_rate(change, self.rate, self.period)
        return maximum(self.k0 + self.gain_rules(ec, e), _LEAST_GAIN)
