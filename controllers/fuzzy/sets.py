"""Uniform fuzzy sets on a universe: triangles and Gaussians.

Inside, lengths are counted in sets: the first peak stands at 0, the second at 1 and so on. So
peaks are whole numbers, and what is mirrored stays mirrored to the bit.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any

from ...base.errors import ParameterError
from ...base.ops import clip, erf, erfinv, exp, finite, log, maximum, minimum, sqrt

LEAST_CROSSING = 1e-3  # ours: where no input set applies by more, the rules would say nothing
_TINY = 1e-300  # heights below count as none, so that a logarithm of 0 is never taken
_BELOW_ONE = 1.0 - 2.0**-53


@dataclass(frozen=True)
class UniformSets(ABC):
    """Sets of one symmetric shape with peaks from one end of a universe to the other.

    Values outside the universe are clipped to it; so are the sets themselves, where they are an
    output's. Raise ParameterError unless low < high and there are two or more different labels.
    """

    low: float
    high: float
    labels: tuple[str, ...]

    def __post_init__(self) -> None:
        if not (finite(self.low) and finite(self.high) and self.low < self.high):
            raise ParameterError(f"universe [{self.low}, {self.high}]: low must lie below high")
        if len(self.labels) < 2 or len(set(self.labels)) != len(self.labels):
            raise ParameterError("a universe needs two or more sets with different labels")

    @property
    def width(self) -> float:
        """Distance of two neighbouring peaks."""
        return (self.high - self.low) / (len(self.labels) - 1)

    def position(self, value: Any) -> Any:
        """Return where a value stands, counted in sets: 0 at the first peak, 1 at the second …"""
        return (clip(value, self.low, self.high) - self.low) / self.width

    def degrees(self, position: Any) -> list[Any]:
        """Return the membership of every set at a position."""
        return [self.degree(position - k) for k in range(len(self.labels))]

    def check_coverage(self, what: str) -> None:
        """Raise ParameterError if between two peaks no set of this input applies."""
        if self.degree(0.5) < LEAST_CROSSING:
            raise ParameterError(
                f"the sets of the {what} leave gaps: midway between two peaks they apply by less "
                f"than {LEAST_CROSSING}, and no rule would fire; widen sigma"
            )

    # The shape. Distances x are from the peak, counted in sets.

    @property
    @abstractmethod
    def reach(self) -> float:
        """Distance beyond which a set does not apply."""

    @abstractmethod
    def degree(self, x: Any) -> Any:
        """Return the membership at a distance, of either sign."""

    @abstractmethod
    def radius(self, height: Any) -> Any:
        """Return the distance at which the membership has fallen to `height`."""

    @abstractmethod
    def flank(self, inner: Any, outer: Any) -> tuple[Any, Any]:
        """Return (area, first moment about the peak) of the shape between two distances."""

    @abstractmethod
    def from_outside(self, outer: Any, area: Any) -> Any:
        """Return the distance down to which a flank, from `outer` inwards, has this area."""


@dataclass(frozen=True)
class Triangles(UniformSets):
    """Uniform triangular sets on a universe; the first and last set peak at its ends.

    Neighbours cross at one half and all degrees add up to one, so some set always applies.
    """

    @property
    def reach(self) -> float:
        """Distance beyond which a set does not apply: that of its neighbour's peak."""
        return 1.0

    def degree(self, x: Any) -> Any:
        """Return max(0, 1 − |x|)."""
        return maximum(0.0, minimum(x + 1.0, 1.0 - x))

    def degrees(self, position: Any) -> list[Any]:
        """Return the membership of every set at a position, to the bits of `active`."""
        return [
            maximum(0.0, minimum(position - (k - 1.0), (k + 1.0) - position))
            for k in range(len(self.labels))
        ]

    def active(self, position: float) -> tuple[int, float, float]:
        """Return (k, membership of set k, membership of set k+1) on floats; no other applies."""
        k = min(int(position), len(self.labels) - 2)
        return k, (k + 1.0) - position, position - k

    def radius(self, height: Any) -> Any:
        """Return 1 − height."""
        return 1.0 - height

    def flank(self, inner: Any, outer: Any) -> tuple[Any, Any]:
        """Return area and first moment of 1 − x, as products that do not cancel."""
        length, total = outer - inner, outer + inner
        area = length * (1.0 - 0.5 * total)
        squares = total * total - outer * inner  # outer² + outer·inner + inner²
        return area, length * (0.5 * total - squares / 3.0)

    def from_outside(self, outer: Any, area: Any) -> Any:
        """Invert the area, which is (z² − z_outer²)/2 for the height z = 1 − x."""
        z = 1.0 - outer
        return 1.0 - sqrt(z * z + 2.0 * maximum(area, 0.0))


@dataclass(frozen=True)
class Gaussians(UniformSets):
    """Uniform Gaussian sets exp(−(x − c)²/(2σ²)); the first and last set peak at the ends.

    `sigma` is σ in the universe's unit; by default neighbours cross at one half, as triangles do:
    σ = width/(2√(2 ln 2)). Every set applies everywhere. Raise ParameterError unless σ > 0.
    """

    sigma: float | None = None
    # σ√2, 1/(σ√2), σ√(π/2), σ² with σ counted in sets: read at every inference.
    _shape: tuple[float, float, float, float] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        UniformSets.__post_init__(self)
        if self.sigma is not None and not (finite(self.sigma) and self.sigma > 0.0):
            raise ParameterError(f"sigma must be a positive number, not {self.sigma!r}")
        spread = (
            1.0 / (2.0 * math.sqrt(2.0 * math.log(2.0)))
            if self.sigma is None
            else self.sigma / self.width
        )
        if not 1e-6 <= spread <= 1e6:
            raise ParameterError(f"sigma = {self.sigma}: peaks are {self.width} apart")
        root = spread * math.sqrt(2.0)
        shape = (root, 1.0 / root, spread * math.sqrt(math.pi / 2.0), spread * spread)
        object.__setattr__(self, "_shape", shape)

    @property
    def reach(self) -> float:
        """No distance at all."""
        return math.inf

    def degree(self, x: Any) -> Any:
        """Return exp(−x²/(2σ²))."""
        t = x * self._shape[1]
        return exp(-(t * t))

    def radius(self, height: Any) -> Any:
        """Return σ √(−2 ln height)."""
        root = self._shape[0]
        return root * sqrt(maximum(-log(maximum(height, _TINY)), 0.0))

    def flank(self, inner: Any, outer: Any) -> tuple[Any, Any]:
        """Return area and first moment: σ√(π/2) Δerf(x/(σ√2)) and −σ² Δexp(−x²/(2σ²))."""
        _, inverse, half, square = self._shape
        t, s = inner * inverse, outer * inverse
        return half * (erf(s) - erf(t)), square * (exp(-(t * t)) - exp(-(s * s)))

    def from_outside(self, outer: Any, area: Any) -> Any:
        """Invert the area by the inverse error function."""
        root, inverse, half, _ = self._shape
        v = erf(outer * inverse) - maximum(area, 0.0) / half
        return root * erfinv(clip(v, 0.0, _BELOW_ONE))
