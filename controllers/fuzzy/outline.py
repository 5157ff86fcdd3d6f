"""What an outline is defuzzified to: centroid, bisector and mean of maxima, all exact.

The outline is the maximum of sets clipped at their heights (see `pieces`). Results are in the
universe's unit. All heights 0 leave nothing to defuzzify: centroid and bisector raise
ZeroDivisionError on floats; a rule base never gets there. Heights below 1e-9 lose digits. Ours.
"""

from collections.abc import Sequence
from typing import Any

from ...base.ops import is_symbol, maximum, minimum, where
from .pieces import Piece, outline, top
from .sets import UniformSets

_TINY = 1e-300  # in a divisor that is 0 only where the quotient is not used


def outline_centroid(output: UniformSets, heights: Sequence[Any]) -> Any:
    """Return the centre of gravity of sets clipped at `heights` and joined by max."""
    area: Any = 0.0
    moment: Any = 0.0
    for piece in outline(output, heights):
        area = area + piece.area
        moment = moment + (piece.moment + piece.peak * piece.area)
    return output.low + output.width * (moment / area)


def bisector(output: UniformSets, heights: Sequence[Any]) -> Any:
    """Return where the area on the left equals that on the right.

    Found from the left and from the right by mirrored arithmetic; the result is the middle. So
    mirrored heights give the mirrored result, and a gap with half the area on either side its
    middle.
    """
    pieces = outline(output, heights)
    left = _half_from_left(output, pieces)
    last = len(output.labels) - 1
    right = last - _half_from_left(output, [p.mirrored(last) for p in reversed(pieces)])
    return output.low + output.width * (0.5 * (left + right))


def _half_from_left(output: UniformSets, pieces: Sequence[Piece]) -> Any:
    """Return the place to the left of which lies half the area: choose the piece, then invert."""
    total: Any = 0.0
    for piece in pieces:
        total = total + piece.area
    half = 0.5 * total
    before: Any = 0.0
    if not is_symbol(total):
        for piece in pieces:
            if before + piece.area >= half:
                return _within_float(output, piece, half - before)
            before += piece.area
        raise ZeroDivisionError("no set applies: all heights are 0")
    chosen, rest, found = list(pieces[0]), half, 0.0
    for piece in pieces:
        after = before + piece.area
        here = where(found, 0.0, after >= half)  # the first piece that reaches one half
        chosen = [where(here, new, old) for new, old in zip(list(piece), chosen, strict=True)]
        rest, found = where(here, half - before, rest), where(here, 1.0, found)
        before = after
    return _within(output, Piece(*chosen), rest)


def _within_float(output: UniformSets, piece: Piece, rest: float) -> float:
    after_flank = rest - piece.left_area
    if after_flank <= 0.0:
        x = output.from_outside(piece.left_flank, rest)
        return piece.peak - min(max(x, piece.radius), piece.left_flank)
    if after_flank <= piece.plateau_area:
        return piece.peak + (after_flank / piece.height - piece.left)
    remaining = piece.right_area - (after_flank - piece.plateau_area)
    x = output.from_outside(piece.right_flank, remaining)
    return piece.peak + min(max(x, piece.radius), piece.right_flank)


def _within(output: UniformSets, piece: Piece, rest: Any) -> Any:
    """Return the place at which a piece has the area `rest`, as `_within_float` does."""
    after_flank = rest - piece.left_area
    on_left, on_plateau = after_flank <= 0.0, after_flank <= piece.plateau_area
    plateau = after_flank / maximum(piece.height, _TINY) - piece.left
    remaining = piece.right_area - (after_flank - piece.plateau_area)
    outer = where(on_left, piece.left_flank, piece.right_flank)
    x = output.from_outside(outer, where(on_left, rest, remaining))
    x = minimum(maximum(x, piece.radius), outer)
    return piece.peak + where(on_left, -x, where(on_plateau, plateau, x))


def mean_of_maxima(output: UniformSets, heights: Sequence[Any]) -> Any:
    """Return the mean of all places where the outline is highest.

    Several plateaus count by their lengths, whether or not they touch. At height 1 they are
    points, and count alike.
    """
    length: Any = 0.0
    moment: Any = 0.0
    count: Any = 0.0
    peaks: Any = 0.0
    for peak, is_top, left, right in top(output, heights):
        own = where(is_top, left + right, 0.0)
        length = length + own
        moment = moment + (peak * own + where(is_top, 0.5 * (right - left) * (right + left), 0.0))
        count = count + where(is_top, 1.0, 0.0)
        peaks = peaks + where(is_top, peak, 0.0)
    pointed = length <= 0.0
    position = where(pointed, peaks, moment) / where(pointed, count, length)
    return output.low + output.width * position
