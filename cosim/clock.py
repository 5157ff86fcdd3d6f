"""Time as integer ticks of a base step: t_k = (start + k · step), rounded once.

A time or step is taken for the decimal (or simple fraction) that its float stands for: 0.05 is
1/20 and not 0.05000000000000000277. So t_k equals the number a user would type, 0.3/0.1 is 3,
and nothing accumulates.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from numbers import Real

from ..base.errors import DiagramError

_SIMPLE = 1_000_000


def is_time(value: object) -> bool:
    """Return whether a value is a finite time: a number of any kind, but no truth value."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def rational(seconds: float | Fraction) -> Fraction:
    """Return the simple fraction that a float stands for, else its shortest decimal."""
    if isinstance(seconds, Fraction):
        return seconds
    seconds = float(seconds)
    simple = Fraction(seconds).limit_denominator(_SIMPLE)
    return simple if float(simple) == seconds else Fraction(repr(float(seconds)))


def plus(a: float, b: float) -> float:
    """Return a + b as decimals: plus(0.1, 0.2) is 0.3."""
    return float(rational(a) + rational(b))


@dataclass(frozen=True)
class Clock:
    """Base step and start time (s); `time(k)` is the time of tick k."""

    step: Fraction
    start: Fraction = Fraction(0)

    def time(self, tick: int) -> float:
        """Return the time of a tick in s."""
        a, b, q = self.integers
        return (a + tick * b) / q

    def place(self, seconds: float) -> Fraction:
        """Return a time as a number of ticks, whole or not."""
        return (rational(seconds) - self.start) / self.step

    def times(self, count: int) -> list[float]:
        """Return the times of the first `count` ticks in s."""
        a, b, q = self.integers
        return [(a + k * b) / q for k in range(count)]

    @cached_property
    def integers(self) -> tuple[int, int, int]:
        """Return (a, b, q) with t_k = (a + k·b) / q: integers, divided once."""
        q = self.start.denominator * self.step.denominator
        a, b = int(self.start * q), int(self.step * q)
        return a, b, q

    def ticks(self, seconds: float | Fraction, what: str) -> int:
        """Return a span in ticks; raise DiagramError if it is not a whole number of them."""
        count = rational(seconds) / self.step
        if count.denominator != 1:
            below = int(count) * self.step
            near = " or ".join(f"{float(t):g}" for t in (below, below + self.step) if t > 0)
            raise DiagramError(
                f"{what} = {float(seconds):g} s is no whole number of steps of "
                f"{float(self.step):g} s; nearest: {near} s"
            )
        return int(count)
