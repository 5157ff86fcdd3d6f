"""Adaptive fuzzy control of speed: variable universe, and a scaling factor from a second inference.

The controller of "Adaptive fuzzy control of the speed of an automatic train operation system".
"""

from dataclasses import dataclass
from typing import Any, Self

from ..base.ops import absolute, clip, exp, is_symbol, maximum, where
from ..cosim.block import Block, require, require_finite, require_limits, require_positive
from .adaptive_rules import ADAPTIVE_RULES, GAMMA_RULES
from .fuzzy import Mamdani

BASE_GAIN = 1.0 / 2.2  # notches for each m/s that the identified train needs to keep its speed


@dataclass(frozen=True, kw_only=True, slots=True)
class AdaptiveFuzzy(Block):
    """u = γ · ku · rules(kec · ec, ke · e) + base_gain · reference, limited.

    e = reference − measurement in m/s, ec = de/dt in m/s² (0 at the first sample), u in notches of
    the handle. The equations are the paper's:

    - ke, section 2.2: E/|e| outside the universe ±E of the rules (3 m/s); inside 1/α(e) with the
      contraction factor α(e) = 1 − m exp(−k e²) (eq. 6 to 8). Always 1 unless `contract`.
    - kec (eq. 9): `kec`, and `kec_small` where |e| < `small_error` (m/s; the bound is ours) or
      after overshoot, when e has the other sign than at the last change of the reference; unless
      `contract` always `kec`.
    - γ in (0, 1], section 2.3: `gamma_rules` for the same two inputs, or 1 without them.

    `base_gain` and the limits are ours: the notch that holds the reference's speed; with 0 u is
    the rules' alone ("absolute"). The output `scale` is γ · ku.
    """

    rules: Mamdani = ADAPTIVE_RULES
    gamma_rules: Mamdani | None = GAMMA_RULES
    contract: bool = True
    m: float = 0.75
    k: float = 2.0
    kec: float = 4.0
    kec_small: float = 5.0
    small_error: float = 0.3
    ku: float = 10.0
    base_gain: float = BASE_GAIN
    limits: tuple[float, float] = (-10.0, 10.0)
    period: float = 0.02

    inputs = {"reference": "m/s", "measurement": "m/s"}
    outputs = {"u": "1", "ke": "1", "kec": "1", "gamma": "1", "scale": "1"}

    def __post_init__(self) -> None:
        require_positive(self, "kec", "kec_small", "ku", "period")
        require_finite(self, "m", "k", "small_error", "base_gain")
        if not is_symbol(self.m):
            require(self, 0.0 <= self.m < 1.0, f"m must lie in [0, 1), not {self.m!r}")
        for name in ("k", "small_error"):
            value = getattr(self, name)
            good = is_symbol(value) or value >= 0.0
            require(self, good, f"{name} must not be negative, not {value!r}")
        require_limits(self)

    @classmethod
    def conventional(cls, **options: Any) -> Self:
        """Return the conventional fuzzy controller: ke = 1, one kec, γ = 1."""
        return cls(contract=False, gamma_rules=None, **options)

    @classmethod
    def variable_universe(cls, **options: Any) -> Self:
        """Return the controller with ke and kec adapted, and γ = 1."""
        return cls(gamma_rules=None, **options)

    @classmethod
    def scaled(cls, **options: Any) -> Self:
        """Return the controller with γ alone: ke = 1, one kec."""
        return cls(contract=False, **options)

    def start(self) -> tuple[float, float, float, float]:
        """Return (last e, last reference, e at its last change, whether the next is the first)."""
        return 0.0, 0.0, 0.0, 1.0

    def step(self, x: Any, reference: Any, measurement: Any) -> tuple[Any, Any]:
        """Return ((u, ke, kec, γ, γ · ku), next state)."""
        last, last_reference, at_change, first = x
        e = reference - measurement
        ec = (e - where(first > 0.5, e, last)) / self.period
        changed = where(first > 0.5, 1.0, where(reference == last_reference, 0.0, 1.0))
        at_change = where(changed > 0.5, e, at_change)
        ke, kec = self.factors(e, at_change)
        row, column = kec * ec, ke * e
        gamma = 1.0 if self.gamma_rules is None else self.gamma_rules(row, column)
        scale = gamma * self.ku
        wanted = scale * self.rules(row, column) + self.base_gain * reference
        u = clip(wanted, *self.limits)
        return (u, ke, kec, gamma, scale), (e, reference, at_change, 0.0)

    def factors(self, e: Any, at_change: Any) -> tuple[Any, Any]:
        """Return (ke, kec) for an error (m/s) and the error at the reference's last change."""
        if not self.contract:
            return 1.0, self.kec
        size, universe = absolute(e), self.rules.columns.high
        outside = universe / maximum(size, universe)
        contraction = 1.0 - self.m * exp(-self.k * (e * e))
        ke = where(size > universe, outside, 1.0 / contraction)
        near = where(size < self.small_error, 1.0, where(e * at_change < 0.0, 1.0, 0.0))
        return ke, where(near > 0.5, self.kec_small, self.kec)
