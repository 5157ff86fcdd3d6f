"""Fuzzy speed control."""

from dataclasses import dataclass
from typing import Any, Self

from ..base.ops import clip, where
from ..cosim.block import Block, require_finite, require_limits, require_positive
from .error_rate import Rate, error_rate, require_rate
from .fuzzy import Mamdani
from .rules import SPEED_RULES


@dataclass(frozen=True, kw_only=True, slots=True)
class FuzzySpeed(Block):
    """Two-dimensional fuzzy controller: u = ku · rules(kec · ec, ke · e), limited.

    Soft-switching paper, section 1.2. `rate` says what ec is: the "derivative" de/dt or the
    "difference" e(k) − e(k−1). At the first sample e(−1) is e(0), or 0 if `kick`.
    """

    ke: float = 0.4
    kec: float = 3.0
    ku: float = 5.0
    rate: Rate = "derivative"
    rules: Mamdani = SPEED_RULES
    limits: tuple[float, float] = (-10.0, 10.0)
    kick: bool = False
    period: float = 0.05

    inputs = {"reference": "m/s", "measurement": "m/s"}
    outputs = {"u": "1"}

    def __post_init__(self) -> None:
        require_finite(self, "ke", "kec", "ku")
        require_positive(self, "period")
        require_limits(self)
        require_rate(self, self.rate)

    @classmethod
    def recommended(cls, **options: Any) -> Self:
        """Return our reading of the paper: ec = de/dt, 0.05 s."""
        return cls(**options)

    @classmethod
    def literal(cls, **options: Any) -> Self:
        """Return the paper to the letter: ec = e(k) − e(k−1), memories that start at 0."""
        return cls(rate="difference", kick=True, **options)

    def start(self) -> tuple[float, float]:
        """Return (last e, whether the next sample is the first and takes e for the last)."""
        return 0.0, 0.0 if self.kick else 1.0

    def step(self, x: Any, reference: Any, measurement: Any) -> tuple[Any, Any]:
        """Return (u, next state)."""
        last, first = x
        e = reference - measurement
        change = e - where(first > 0.5, e, last)
        ec = error_rate(change, self.rate, self.period)
        u = clip(self.ku * self.rules(self.kec * ec, self.ke * e), *self.limits)
        return u, (e, 0.0)
