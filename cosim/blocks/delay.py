"""A transport delay."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any, Literal

from ...base.ops import finite
from ..block import Block, require
from ..clock import rational


@lru_cache(maxsize=1024)
def _steps(time: float, step: Fraction) -> Fraction:
    return rational(time) / step


@dataclass(frozen=True, slots=True)
class Delay(Block):
    """y(t) = u(t − time) for t ≥ t0 + time; before that the initial history.

    `time` is the delay in s, 0 and below the step included. Between samples u is a straight line
    ("linear") or the last sample ("hold", for signals that a controller holds). `initial` is the
    history: a value, or a function of time t (s) for t < t0.

    At t = t0 + time the block gives u(t0), as Modelica's delay does; Simulink still shows the
    initial output at that instant. Direct feedthrough only where y needs the present u: for
    time = 0, and for linear interpolation with a delay below one step.

    The engine keeps the samples, in a ring as long as the delay.
    """

    time: float
    initial: float | Callable[[float], float] = 0.0
    interpolation: Literal["linear", "hold"] = "linear"

    run_by_engine = True
    inputs = {"u": None}
    outputs = {"y": None}

    def __post_init__(self) -> None:
        good = finite(self.time) and self.time >= 0.0
        require(self, good, f"time must be a number of seconds from 0, not {self.time!r}")
        good = callable(self.initial) or finite(self.initial)
        require(self, good, f"initial must be a number or a function, not {self.initial!r}")
        good = self.interpolation in ("linear", "hold")
        require(self, good, f"interpolation is 'linear' or 'hold', not {self.interpolation!r}")

    @property
    def continuous(self) -> bool:
        """Whether the output is a continuous signal."""
        return self.interpolation == "linear"

    def split(self, step: Fraction) -> tuple[int, float]:
        """Return the delay as (whole steps, remaining fraction of a step).

        With "hold" a part of a step counts as a whole one: at t − time the sample before holds.
        """
        return self.split_steps(self.steps(step))

    def split_steps(self, steps: Fraction) -> tuple[int, float]:
        """Return what `split` does, from the delay in steps."""
        whole = steps.numerator // steps.denominator
        part = steps - whole
        if self.interpolation == "hold":
            return (whole + 1 if part else whole), 0.0
        return whole, float(part)

    def jumps_between(self, step: Fraction) -> bool:
        """Return whether the output may jump between two steps: at a held signal's edges, at least
        where the history ends.
        """
        return self.steps(step).denominator > 1

    def steps(self, step: Fraction) -> Fraction:
        """Return the delay in steps, exactly."""
        return _steps(self.time, step)

    def history(self, t: float) -> Any:
        """Return the initial history at time t (s)."""
        return self.initial(t) if callable(self.initial) else self.initial
