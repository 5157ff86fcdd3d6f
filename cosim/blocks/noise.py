"""Seeded normal noise."""

from dataclasses import dataclass
from functools import lru_cache

from ..block import require, require_finite
from .source import Source

_CHUNK = 1024


@lru_cache(maxsize=64)
def _normals(seed: int, chunk: int) -> tuple[float, ...]:
    """Return the `chunk`-th 1024 numbers of the seed's stream: any place of it can be reached."""
    import numpy as np

    return tuple(np.random.default_rng([seed, chunk]).standard_normal(_CHUNK).tolist())


@dataclass(frozen=True, kw_only=True, slots=True)
class Noise(Source):
    """Independent normal numbers, one at each sample hit and held between: mean + deviation · n_k.

    The numbers depend only on the seed and on how many came before; the state is that count.
    """

    seed: int
    deviation: float = 1.0
    mean: float = 0.0
    period: float | None = None

    def __post_init__(self) -> None:
        Source.__post_init__(self)
        require_finite(self, "mean", "deviation")
        require(self, self.deviation >= 0.0, f"deviation must not be negative: {self.deviation!r}")
        good = isinstance(self.seed, int) and self.seed >= 0
        require(self, good, f"seed must be a whole number from 0, not {self.seed!r}")

    def start(self) -> int:
        """Return 0: no number has been drawn."""
        return 0

    def output(self, x: int, *time: float) -> float:
        """Return number x of the stream."""
        return self.mean + self.deviation * _normals(self.seed, x // _CHUNK)[x % _CHUNK]

    def update(self, x: int, *u: float) -> int:
        """Count one number."""
        return x + 1
