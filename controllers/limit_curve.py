"""The limit curve that an ATP supervises: the highest speed allowed at each place of the line."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from ..base.ops import finite, is_symbol, maximum, minimum, sqrt, where
from ..cosim.block import Block, require, require_finite, require_positive

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True, kw_only=True, slots=True)
class LimitCurve(Block):
    """v_lim(s): the lowest speed that `maximum`, restrictions and stops allow at a place s (m).

    - `maximum` (m/s) holds everywhere.
    - `restrictions` are (from in m, to in m, speed in m/s). One holds until the tail has left it,
      so up to and including to + `train_length`; before it, it allows
      sqrt(speed² + 2 · braking · (from − s)).
    - `stops` are danger points (m, ascending) that must not be passed: before one v_lim is
      sqrt(2 · braking · (stop − s)), beyond it 0. A stop holds until it is released: `released` is
      how many of them, the first ones, hold no longer.

    `braking` (m/s²) is the deceleration that the brake guarantees; s is the place of the train's
    head. Before a target the curve has the shape of the stopping curve in Fig. 1 of the adaptive
    fuzzy ATO paper, which gives no limit curve: the rules and all numbers are our choice. As a
    block it has the input `position` and the output `limit`, without any stop released.
    Raise ParameterError for a wrong number, naming it.
    """

    maximum: float
    braking: float
    restrictions: tuple[tuple[float, float, float], ...] = ()
    stops: tuple[float, ...] = ()
    train_length: float = 0.0

    inputs = {"position": "m"}
    outputs = {"limit": "m/s"}

    def __post_init__(self) -> None:
        require_positive(self, "maximum", "braking")
        require_finite(self, "train_length")
        good = is_symbol(self.train_length) or self.train_length >= 0.0
        require(self, good, f"train_length must be a length from 0 m, not {self.train_length!r}")
        for name in ("restrictions", "stops"):
            value: Any = getattr(self, name)
            good = isinstance(value, Iterable)
            require(self, good, f"{name} must be a list, not {value!r}")
            items = tuple(tuple(v) if isinstance(v, list) else v for v in value)
            object.__setattr__(self, name, items)
        for restriction in self.restrictions:
            self._check(restriction)
        for stop in self.stops:
            require(self, finite(stop), f"a stop must be a place in m, not {stop!r}")
        for a, b in pairwise(self.stops):
            require(self, a < b, f"stops must ascend; {b:g} m follows {a:g} m")

    def _check(self, restriction: Any) -> None:
        good = (
            isinstance(restriction, tuple)
            and len(restriction) == 3
            and all(finite(number) for number in restriction)
        )
        require(self, good, f"a restriction is (from in m, to in m, m/s), not {restriction!r}")
        start, end, speed = restriction
        good = start < end
        require(self, good, f"a restriction from {start:g} m must end behind it, not at {end:g} m")
        require(
            self,
            speed > 0.0,
            f"the restriction from {start:g} m needs a positive speed, not {speed:g} m/s; "
            "a place that must not be passed is a stop",
        )

    def step(self, x: Any, position: Any) -> tuple[Any, Any]:
        """Return (the limit in m/s, no state)."""
        return self.speed(position), x

    def speed(self, position: Any, released: Any = 0.0) -> Any:
        """Return v_lim (m/s) at a place (m), the first `released` stops being released."""
        # The square of a float and its root give the same float again: v_lim is exact on flats.
        lowest: Any = self.maximum * self.maximum
        for start, end, speed in self.restrictions:
            allowed = speed * speed + 2.0 * self.braking * maximum(start - position, 0.0)
            holds = position <= end + self.train_length
            lowest = where(holds, minimum(lowest, allowed), lowest)
        for number, stop in enumerate(self.stops):
            allowed = 2.0 * self.braking * maximum(stop - position, 0.0)
            lowest = where(released > number + 0.5, lowest, minimum(lowest, allowed))
        return sqrt(lowest)

    def excess(
        self, position: Any, speed: Any, *, acceleration: Any, time: Any, released: Any = 0.0
    ) -> Any:
        """Return by how much v² may come above v_lim² within a time (s), in m²/s².

        The train may accelerate with up to `acceleration` (m/s², not negative) for that time. Then
        at no place s' on its way v'² is above v² + 2 · acceleration · (s' − s), and full
        acceleration reaches this. The largest of v'² − v_lim(s')² over the whole way is returned:
        up to 0 the curve cannot be passed; above 0 it would be. A speed below 0 counts as 0.
        """
        speed = maximum(speed, 0.0)
        reach = (speed + 0.5 * acceleration * time) * time
        square = speed * speed
        worst = square + 2.0 * acceleration * reach - self.maximum * self.maximum
        # What a target leaves only shrinks on the way up to its end: the way's last place decides.
        for start, end, limit in self.restrictions:
            left = end + self.train_length - position
            way = minimum(reach, maximum(left, 0.0))
            allowed = limit * limit + 2.0 * self.braking * maximum(start - position - way, 0.0)
            above = square + 2.0 * acceleration * way - allowed
            worst = where(left >= 0.0, maximum(worst, above), worst)
        for number, stop in enumerate(self.stops):
            allowed = 2.0 * self.braking * maximum(stop - position - reach, 0.0)
            above = square + 2.0 * acceleration * reach - allowed
            worst = where(released > number + 0.5, worst, maximum(worst, above))
        return worst

    def before_stop(self, position: Any, within: Any, released: Any = 0.0) -> Any:
        """Return 1 if the next stop lies at most `within` (m) ahead of a place (m), else 0."""
        found: Any = 0.0
        for number, stop in enumerate(self.stops):
            left = stop - position
            near = where(left >= 0.0, where(left <= within, 1.0, 0.0), 0.0)
            is_next = where(released > number - 0.5, where(released < number + 0.5, 1.0, 0.0), 0.0)
            found = found + is_next * near
        return found

    def points(
        self, start: float, end: float, *, released: int = 0, count: int = 501
    ) -> "tuple[np.ndarray, np.ndarray]":
        """Return places (m) and v_lim (m/s) from start to end, for plotting.

        Beside `count` equal distances there are both ends of every restriction, the last one with
        the place right behind it, and every stop: so edges are drawn upright. Raise
        ParameterError unless start < end and count ≥ 2.
        """
        import numpy as np

        require(self, start < end, f"points from {start!r} m must end behind it, not at {end!r} m")
        require(self, count >= 2, f"count must be 2 or more, not {count!r}")
        edges = [*self.stops]
        for first, last, _ in self.restrictions:
            left = last + self.train_length
            edges += [first, left, float(np.nextafter(left, np.inf))]
        inside = [s for s in edges if start <= s <= end]
        places = np.unique(np.concatenate([np.linspace(start, end, count), inside]))
        return places, np.array([self.speed(s, released) for s in places.tolist()])
