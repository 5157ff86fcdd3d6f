"""A transport delay whose time is a signal."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, NoReturn

from ...base.ops import finite
from ..block import Block, require, require_positive
from .delay_buffer import Sample, append, around

# Two times that differ by less than this part of their size are one time, rounded twice.
_SAME = 2.0**-48


@dataclass(frozen=True, kw_only=True, slots=True)
class VariableDelay(Block):
    """y(t) = u(t − T), where T follows from the input `delay` = τ(t) in s in one of two ways.

    kind "time": T = τ(t), Simulink's Variable Time Delay.
    kind "transport": what enters passes a pipe whose transit time is τ at the moment, so T is the
    span with ∫ ds/τ(s) = 1 from t − T to t; τ = L/v for a length L and a speed v. Simulink's
    Variable Transport Delay. Before the start t0, τ counts as τ(t0).

    `maximum` is the longest T in s and `smallest` the shortest. Another T ends the run, and so does
    a negative τ, for "transport" also zero. For "transport" τ itself may be larger, as when the
    flow stops; what entered since t0 must leave within `maximum`. The samples of that time are
    kept, and at most 128 more.

    `initial` is the history: a value, or a function of time t (s) for t < t0. At t − T = t0 the
    block gives u(t0), as Delay does.

    Between samples u and the speed 1/τ are straight lines ("linear") or stay as they were at the
    sample before ("hold").

    With smallest = 0, y may need the present u: a loop through u is an algebraic loop, however
    long the delay. With smallest > 0 only `delay` has direct feedthrough; then "linear" needs a T
    of one step or more.
    """

    maximum: float
    smallest: float = 0.0
    kind: Literal["time", "transport"] = "time"
    initial: float | Callable[[float], float] = 0.0
    interpolation: Literal["linear", "hold"] = "linear"
    feedthrough: bool = field(init=False, repr=False, compare=False)
    direct: tuple[str, ...] = field(init=False, repr=False, compare=False)

    timed = True
    inputs = {"u": None, "delay": "s"}
    outputs = {"y": None}

    def __post_init__(self) -> None:
        require_positive(self, "maximum")
        good = finite(self.smallest) and 0.0 <= self.smallest <= self.maximum
        require(self, good, f"smallest must lie from 0 to maximum, not {self.smallest!r}")
        good = self.kind in ("time", "transport")
        require(self, good, f"kind is 'time' or 'transport', not {self.kind!r}")
        good = callable(self.initial) or finite(self.initial)
        require(self, good, f"initial must be a number or a function, not {self.initial!r}")
        good = self.interpolation in ("linear", "hold")
        require(self, good, f"interpolation is 'linear' or 'hold', not {self.interpolation!r}")
        object.__setattr__(self, "feedthrough", self.smallest == 0.0)
        object.__setattr__(self, "direct", () if self.feedthrough else ("delay",))

    # The state is () or (t0, τ(t0), chunks, tail) with samples (t, u), for "transport"
    # (n, f, rate, carry, t, u): see _place.

    def step(self, x: Any, t: float, u: Any, delay: float) -> tuple[Any, Any]:
        """Return (output, state with the sample at t); for smallest = 0."""
        x = self.update(x, t, u, delay)
        return self._leaving(x, t, delay, x[3][-1]), x

    def output(self, x: Any, t: float, delay: float) -> Any:
        """Return the output, found in the samples before t; for smallest > 0."""
        place = () if self.kind == "time" else self._place(x, t, delay)
        return self._leaving(x, t, delay, (*place, t, None))

    def update(self, x: Any, t: float, u: Any, delay: float) -> Any:
        """Return the state with the sample at t."""
        sample = (t, u) if self.kind == "time" else (*self._place(x, t, delay), t, u)
        if not x:
            return t, delay, (), (sample,)
        start, first_delay, chunks, tail = x
        oldest = t - self.maximum - _SAME * (abs(t) + self.maximum)
        return start, first_delay, *append((chunks, tail), sample, oldest)

    def history(self, t: float) -> Any:
        """Return the initial history at time t (s)."""
        return self.initial(t) if callable(self.initial) else self.initial

    def _place(self, x: Any, t: float, delay: float) -> tuple[int, float, float, float]:
        """Return (n, f, rate, carry): since t0 the pipe's content was renewed n + f times.

        n is whole, so t − T lies at exactly (n − 1, f), after any time. The carry is what rounding
        left of f; so whole steps add up to whole renewals.
        """
        rate = 1.0 / delay if 0.0 < delay < math.inf else math.inf
        if rate == math.inf:
            raise ValueError(f"delay = {delay:g} s must be positive, and finite, for a transport")
        if not x:
            return 0, 0.0, rate, 0.0
        n, f, last_rate, carry, last, _ = x[3][-1]
        mean = last_rate if self.interpolation == "hold" else 0.5 * (last_rate + rate)
        more = (t - last) * mean + carry
        if more <= 0.0:
            return n, f, rate, more
        total = f + more
        added = total - f
        carry = (f - (total - added)) + (more - added)
        whole = int(total)
        return n + whole, total - whole, rate, carry

    def _leaving(self, x: Any, t: float, delay: float, present: Sample) -> Any:
        """Return y(t); `present` is the sample at t, with the value None if that is not known."""
        start, buffer = (x[0], x[2:]) if x else (t, ((), ()))
        if self.kind == "time":
            older, newer = around(buffer, (t - delay, math.inf))
            newer = newer or present
            span = inside = delay
        else:
            n, f = present[0] - 1, present[1]
            older, newer = around(buffer, (n, f, math.inf))
            newer = newer or present
            if older is not None:
                span = inside = self._transit(t, n, f, older, newer)
            else:
                inside = t - start if n < 0 else math.inf
                span = inside + (x[1] if x else delay) * (1.0 - f)
        slack = _SAME * (abs(t) + abs(span))
        if not (self.smallest <= span + slack and inside - slack <= self.maximum):
            self._refuse(delay, span)
        time, new = newer[-2:]
        past = span - (t - time)  # from the moment looked for to the newer sample
        if past <= slack:
            if new is not None:
                return new
        elif older is not None:
            time_before, old = older[-2:]
            if self.interpolation == "hold" or t - time_before - span <= slack:
                return old
            if new is not None:
                return new + past / (time - time_before) * (old - new)
        elif t - span < start:
            return self.history(t - span)
        else:
            raise ValueError(f"maximum was raised in the run; samples before {time:g} s are gone")
        raise ValueError(
            f"delay = {delay:g} s with smallest = {self.smallest:g} s asks for a sample that is "
            f"not there at {t - span:.9g} s; with smallest above 0 it must be one step or more"
        )

    def _transit(self, t: float, n: int, f: float, older: Sample, newer: Sample) -> float:
        """Return the s since the place (n, f) between two samples was at the pipe's entry."""
        if self.interpolation == "hold":
            passed = (n - older[0]) + (f - older[1])
            return t - older[-2] - (passed / older[2] if passed > 0.0 else 0.0)
        left = (newer[0] - n) + (newer[1] - f)
        rate, time = newer[2], newer[-2]
        # From the newer sample backwards the rate falls by `bend` per s.
        bend = (rate - older[2]) / (time - older[-2])
        root = math.sqrt(max(rate * rate - 2.0 * bend * left, 0.0))
        return t - time + (2.0 * left / (rate + root) if left > 0.0 else 0.0)

    def _refuse(self, delay: float, span: float) -> NoReturn:
        if self.kind == "time":
            raise ValueError(
                f"delay = {delay:g} s must lie from smallest = {self.smallest:g} s to "
                f"maximum = {self.maximum:g} s"
            )
        bound = f"{span:g} s, less than smallest = {self.smallest:g}"
        if not span < self.smallest:
            bound = f"more than maximum = {self.maximum:g}"
        raise ValueError(f"at delay = {delay:g} s what leaves has been inside for {bound} s")
