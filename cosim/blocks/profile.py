"""A piecewise-linear profile over time."""

import math
from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from ...base.ops import finite
from ..block import require
from .source import Source


@dataclass(frozen=True, slots=True)
class Profile(Source):
    """Straight lines through points (time in s, value); the first and last value are held outside.

    Two points at one time make a jump: from that time on the second one holds.
    """

    points: tuple[tuple[float, float], ...]
    _times: tuple[float, ...] = field(init=False, repr=False, compare=False)
    _jumps: tuple[float, ...] = field(init=False, repr=False, compare=False)

    timed = True
    continuous = True

    def __post_init__(self) -> None:
        Source.__post_init__(self)
        pairs = tuple(tuple(point) for point in self.points)
        require(self, pairs, "points must hold at least one (time, value) pair")
        for pair in pairs:
            good = len(pair) == 2 and all(finite(number) for number in pair)
            require(self, good, f"{pair!r} is not a pair (time, value) of finite numbers")
        for (a, _), (b, _) in pairwise(pairs):
            require(self, a <= b, f"times must not decrease, but {b:g} s follows {a:g} s")
        object.__setattr__(self, "points", pairs)
        object.__setattr__(self, "_times", tuple(float(pair[0]) for pair in pairs))
        jumps = tuple(a for a, b in pairwise(self._times) if a == b)
        object.__setattr__(self, "_jumps", jumps)

    def output(self, x: Any, t: float) -> float:
        """Return the value at time t (s)."""
        i = bisect_right(self._times, t)
        if i == 0 or i == len(self._times):
            return self.points[min(i, len(self.points) - 1)][1]
        (t0, y0), (t1, y1) = self.points[i - 1], self.points[i]
        return y0 + (y1 - y0) * ((t - t0) / (t1 - t0))

    def next_event(self, x: Any, t: float) -> float:
        """Return the time (s) of the next jump."""
        i = bisect_right(self._jumps, t)
        return self._jumps[i] if i < len(self._jumps) else math.inf
