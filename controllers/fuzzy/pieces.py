"""The outline of clipped sets, joined by max, cut into pieces whose areas are closed forms.

All sets have one shape g, symmetric about the peak and falling from it. Set j, clipped at h_j at
the radius ρ_j with g(ρ_j) = h_j, shows at most a left flank, a plateau at h_j and a right flank,
and in the order of the universe the outline is those of set 0, of set 1 and so on:

- The right flank shows from ρ_j out to the least of max(ρ_m, d/2) over all m > j, d the distance
  of their peaks: beyond d/2 set m lies higher, if it is not clipped below.
- The plateau ends on the right at ρ_j; or, where a set m > j is higher, at d − ρ_j, where that
  set's flank passes h_j. Sets of one height share what they have in common at d/2, so that what
  is mirrored stays mirrored.
- Both end at the universe's end. The left side mirrors the right one.

Ours. Lengths are counted in sets, as in `sets`.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from ...base.ops import is_symbol, maximum, minimum, where
from .sets import UniformSets


class Piece(NamedTuple):
    """What of one set shows in the outline: left flank, plateau, right flank.

    The plateau goes from `left` before the peak to `right` behind it (either may be negative);
    the flanks from `radius` out to `left_flank` and `right_flank`. `moment` is about the peak.
    """

    peak: Any
    height: Any
    radius: Any
    left: Any
    right: Any
    left_flank: Any
    right_flank: Any
    left_area: Any
    plateau_area: Any
    right_area: Any
    area: Any
    moment: Any

    def mirrored(self, last: int) -> "Piece":
        """Return the piece of the mirrored outline; `last` is the last peak."""
        return Piece(
            last - self.peak, self.height, self.radius, self.right, self.left, self.right_flank,
            self.left_flank, self.right_area, self.plateau_area, self.left_area, self.area,
            -self.moment,
        )  # fmt: skip


def outline(output: UniformSets, heights: Sequence[Any]) -> list[Piece]:
    """Return the outline's pieces from left to right; on floats only of sets that apply."""
    if any(is_symbol(h) for h in heights):
        places, side = range(len(heights)), _side
    else:
        places, side = [k for k, h in enumerate(heights) if h > 0.0], _side_of_floats
    radii = {k: output.radius(heights[k]) for k in places}
    last, found = len(heights) - 1, []
    for n, k in enumerate(places):
        left, left_flank = side(radii, k, places[:n][::-1], output.reach, float(k))
        right, right_flank = side(radii, k, places[n + 1 :], output.reach, float(last - k))
        found.append(_piece(output, k, heights[k], radii[k], left, right, left_flank, right_flank))
    return found


def _piece(
    output: UniformSets, peak: int, height: Any, radius: Any,
    left: Any, right: Any, left_flank: Any, right_flank: Any,
) -> Piece:  # fmt: skip
    length = maximum(left + right, 0.0)
    plateau = height * length
    left_area, left_moment = _flank(output, radius, left_flank)
    right_area, right_moment = _flank(output, radius, right_flank)
    return Piece(
        peak, height, radius, left, right, left_flank, right_flank, left_area, plateau, right_area,
        plateau + (left_area + right_area),
        (right_moment - left_moment) + 0.5 * plateau * (right - left),
    )  # fmt: skip


def _flank(output: UniformSets, inner: Any, outer: Any) -> tuple[Any, Any]:
    if isinstance(outer, float) and outer == inner:
        return 0.0, 0.0  # exactly what the shape gives
    return output.flank(inner, outer)


def _side(
    radii: dict[int, Any], k: int, others: Sequence[int], reach: float, end: float
) -> tuple[Any, Any]:
    """Return how far plateau and flank of set k show to one side.

    `others` are the sets there, the nearest first, and `end` is the distance of the universe's
    end.
    """
    own = radii[k]
    plateau, flank = minimum(own, end), min(reach, end)
    for m in others:
        distance, radius = float(abs(m - k)), radii[m]
        if 0.5 * distance >= reach:
            break  # sets that do not overlap
        shared = where(radius == own, 0.5 * distance, plateau)
        plateau = minimum(plateau, where(radius < own, distance - own, shared))
        flank = minimum(flank, maximum(radius, 0.5 * distance))
    return plateau, maximum(flank, own)


def _side_of_floats(
    radii: dict[int, float], k: int, others: Sequence[int], reach: float, end: float
) -> tuple[float, float]:
    """Return the same as `_side`, and stop at the set behind which none can matter."""
    own = radii[k]
    plateau, flank = own if own < end else end, reach if reach < end else end
    for m in others:
        distance, radius = abs(m - k), radii[m]
        half = 0.5 * distance
        if half >= flank and half >= own:
            break
        if radius <= own:
            limit = half if radius == own else distance - own
            if limit < plateau:
                plateau = limit
        edge = radius if radius > half else half
        if edge < flank:
            flank = edge
    return plateau, flank if flank > own else own


def top(output: UniformSets, heights: Sequence[Any]) -> Iterator[tuple[int, Any, Any, Any]]:
    """Yield (peak, whether the set is among the highest, how far its plateau goes left, right).

    The highest plateaus, where they overlap, meet midway between their peaks.
    """
    highest: Any = 0.0
    for h in heights:
        highest = maximum(highest, h)
    symbolic, last = is_symbol(highest), len(heights) - 1
    tops = [h == highest for h in heights]
    radius = output.radius(highest)
    places = range(len(heights)) if symbolic else [k for k, is_top in enumerate(tops) if is_top]
    for n, k in enumerate(places):
        left, right = minimum(radius, float(k)), minimum(radius, float(last - k))
        for m in places[:n]:
            left = minimum(left, where(tops[m], 0.5 * (k - m), left))
        for m in places[n + 1 :]:
            right = minimum(right, where(tops[m], 0.5 * (m - k), right))
        yield k, tops[k], left, right
