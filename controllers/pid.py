"""PID control of speed."""

from dataclasses import dataclass
from typing import Any, Self

from ..base.ops import clip, finite, is_symbol, where
from ..cosim.block import Block, require, require_limits, require_positive
from .tuning import simc, ziegler_nichols


@dataclass(frozen=True, kw_only=True, slots=True)
class PID(Block):
    """Ideal (parallel) PID: u = kp e + I + D, limited, e = reference − measurement.

    I grows by period · kp/ti · e at each sample before it is used, and not at a sample whose u
    is limited (anti-windup). D is kp td de/dt through a first-order filter with time constant
    `filter_time` (s; default td/10), backward Euler. At the first sample e(−1) = e(0), so that a
    step in the reference at the start gives no derivative kick, unless `kick` sets e(−1) = 0.
    ti = inf leaves out the integral, td = 0 the derivative.
    """

    kp: float
    ti: float
    td: float
    filter_time: float | None = None
    limits: tuple[float, float] = (-10.0, 10.0)
    kick: bool = False
    period: float = 0.05

    inputs = {"reference": "m/s", "measurement": "m/s"}
    outputs = {"u": "1"}

    def __post_init__(self) -> None:
        require_positive(self, "kp", "period")
        if not is_symbol(self.ti):
            good = isinstance(self.ti, int | float) and self.ti > 0.0
            require(self, good, f"ti must be a time in s, or inf for no integral, not {self.ti!r}")
        for name in ("td", "filter_time"):
            value = getattr(self, name)
            if value is not None and not is_symbol(value):
                require(self, finite(value) and value >= 0.0, f"{name} must be a time from 0 s")
        require_limits(self)

    @classmethod
    def ziegler_nichols(
        cls, *, gain: float, time_constant: float, dead_time: float, **options: Any
    ) -> Self:
        """Return the PID that Ziegler and Nichols' reaction-curve rules give; see `tuning`."""
        rules = ziegler_nichols(gain=gain, time_constant=time_constant, dead_time=dead_time)
        return cls(**rules, **options)

    @classmethod
    def simc(
        cls, *, gain: float, tau1: float, tau2: float, tau_c: float, dead_time: float = 0.0,
        **options: Any,
    ) -> Self:  # fmt: skip
        """Return the PID that Skogestad's SIMC rules give; see `tuning`."""
        rules = simc(gain=gain, tau1=tau1, tau2=tau2, tau_c=tau_c, dead_time=dead_time)
        return cls(**rules, **options)

    def start(self) -> tuple[float, float, float, float]:
        """Return (I, D, last e, whether the next sample is the first and takes e for the last)."""
        return 0.0, 0.0, 0.0, 0.0 if self.kick else 1.0

    def step(self, x: Any, reference: Any, measurement: Any) -> tuple[Any, Any]:
        """Return (u, next state)."""
        integral, derivative, last, first = x
        e = reference - measurement
        last = where(first > 0.5, e, last)
        filter_time = self.td / 10.0 if self.filter_time is None else self.filter_time
        derivative = (filter_time * derivative + self.kp * self.td * (e - last)) / (
            filter_time + self.period
        )
        grown = integral + self.kp / self.ti * self.period * e
        wanted = self.kp * e + grown + derivative
        u = clip(wanted, *self.limits)
        return u, (where(u == wanted, grown, integral), derivative, e, 0.0)
