"""How the truth of one train at one station changes from stop to stop."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from .truth import ABSOLUTE, SPREAD, Truth

SLOW, DAILY = 0.998, 0.85  # what is kept from one stop to the next
OWN = ("speed", "position")  # drawn anew at each stop


@dataclass(frozen=True, kw_only=True)
class Drift:
    """Shares of a parameter's variance: slow, daily (medium), and of each stop alone.

    Each parameter is driven by z = √slow · x + √daily · y + √alone · n with x and y stationary
    first-order processes of unit variance that keep SLOW and DAILY from stop to stop, n white.
    The normal distribution of z is mapped to the uniform one of the spread, so that a stop by
    itself is as any independent one. Shares and factors are our choice.
    """

    friction: tuple[float, float, float]
    mass: tuple[float, float, float]
    others: tuple[float, float, float]

    def chain(
        self, nominal: Truth, generator: np.random.Generator, stops: int, scale: float = 1.0
    ) -> Iterator[Truth]:
        """Yield the truths of stops one after the other, around the nominal numbers."""
        names = [*SPREAD, *ABSOLUTE]
        shares = np.array([self._shares(name) for name in names]).T
        halves = [SPREAD[n] * getattr(nominal, n) if n in SPREAD else ABSOLUTE[n] for n in names]
        slow, daily = generator.standard_normal((2, len(names)))
        for _ in range(stops):
            alone, fresh, news = generator.standard_normal((3, len(names)))
            z = (np.sqrt(shares) * np.array([slow, daily, alone])).sum(axis=0)
            values = {
                n: getattr(nominal, n) + scale * half * math.erf(float(a) / math.sqrt(2.0))
                for n, half, a in zip(names, halves, z, strict=True)
            }
            yield replace(nominal, **values)
            slow = SLOW * slow + math.sqrt(1.0 - SLOW**2) * fresh
            daily = DAILY * daily + math.sqrt(1.0 - DAILY**2) * news

    def _shares(self, name: str) -> tuple[float, float, float]:
        if name in OWN:
            return (0.0, 0.0, 1.0)
        return {"air_gain": self.friction, "mass_ratio": self.mass}.get(name, self.others)


BENIGN = Drift(friction=(0.55, 0.35, 0.10), mass=(0.3, 0.7, 0.0), others=(0.9, 0.0, 0.1))
HARSH = Drift(friction=(0.4, 0.3, 0.3), mass=(0.2, 0.5, 0.3), others=(0.7, 0.0, 0.3))
DRIFTS = {"benign": BENIGN, "harsh": HARSH}
