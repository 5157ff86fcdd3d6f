"""What a train measures of its own place and speed: wheels, noise and balises."""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

from ..base.ops import finite
from ..cosim.block import Block, require, require_finite, require_positive

_CHUNK = 256


@lru_cache(maxsize=256)
def _normals(seed: int, stream: int, chunk: int) -> tuple[float, ...]:
    """Return the `chunk`-th 256 numbers of one of the seed's streams."""
    import numpy as np

    return tuple(np.random.default_rng([seed, stream, chunk]).standard_normal(_CHUNK).tolist())


@dataclass(frozen=True, kw_only=True, slots=True)
class Odometry(Block):
    """Position (m) and speed (m/s) as the train measures them, sampled every `period` s and held.

    A wheel counts (1 + `scale`) m for each metre; at the first sample the place is known. At a
    balise, `balises` m before the mark at 0, the place is set right: the wheel counts on from
    there. With `calibrate`, two balises one after the other give the wheel's scale, which from
    then on divides what it counts and the speed. To both measurements normal noise is added,
    independent from sample to sample, of sd `position_noise` (m) and `speed_noise` (m/s): two
    streams that depend on nothing but `seed` and on how many samples came before. The balises are
    read at their true places. Our choice throughout; the paper says nothing of odometry.

    The state is (samples so far, true place and counted place of the last fix, wheel's metre,
    balises passed). Raise ParameterError for wrong numbers.
    """

    position_noise: float = 0.02
    speed_noise: float = 0.02
    scale: float = 0.0
    balises: tuple[float, ...] = ()
    seed: int = 0
    period: float = 0.2
    calibrate: bool = True

    inputs = {"position": "m", "speed": "m/s"}
    outputs = {"position": "m", "speed": "m/s"}

    def __post_init__(self) -> None:
        require_finite(self, "position_noise", "speed_noise", "scale")
        require_positive(self, "period")
        for name in ("position_noise", "speed_noise"):
            value = getattr(self, name)
            require(self, value >= 0.0, f"{name} must not be negative: {value!r}")
        require(self, self.scale > -1.0, f"scale must be above -1, not {self.scale!r}")
        good = isinstance(self.seed, int) and self.seed >= 0
        require(self, good, f"seed must be a whole number from 0, not {self.seed!r}")
        good = isinstance(self.balises, tuple) and all(finite(b) for b in self.balises)
        good = good and all(a > b for a, b in pairwise(self.balises))
        require(
            self, good, f"balises must be distances before the mark that fall, not {self.balises!r}"
        )

    def start(self) -> tuple[float, float, float, float, float]:
        """Return the state before the first sample."""
        return 0.0, 0.0, 0.0, 1.0, 0.0

    def step(self, x: Any, position: Any, speed: Any) -> tuple[Any, Any]:
        """Return ((position, speed) as measured, next state)."""
        count, *fix = x
        true, counted, metre, passed = fix if count else self._first(position)
        while passed < len(self.balises) and position >= -self.balises[int(passed)]:
            place = -self.balises[int(passed)]
            if self.calibrate and passed and true == -self.balises[int(passed) - 1]:
                metre = 1.0 + self.scale  # counted between the two, over their distance
            true = counted = place
            passed += 1.0
        wheel = (1.0 + self.scale) / metre
        place = counted + wheel * (position - true)
        k = int(count)
        measured = (
            place + self.position_noise * _normals(self.seed, 0, k // _CHUNK)[k % _CHUNK],
            wheel * speed + self.speed_noise * _normals(self.seed, 1, k // _CHUNK)[k % _CHUNK],
        )
        return measured, (count + 1.0, true, counted, metre, passed)

    def _first(self, position: float) -> tuple[float, float, float, float]:
        """Return the fix at the first sample; balises that lie behind are of no use."""
        behind = sum(position > -distance for distance in self.balises)
        return position, position, 1.0, float(behind)
