"""The centre of gravity of clipped triangles, in closed form between neighbouring peaks."""

from collections.abc import Sequence
from typing import Any

from ...base.ops import minimum
from .sets import Triangles


def centroid(output: Triangles, heights: Sequence[Any]) -> Any:
    """Return the centre of gravity of triangles clipped at `heights` and joined by max.

    Exact. Between peaks k and k+1, with s from 0 to 1, the outline is
    max(min(p, 1−s), min(r, s)), where p and r are the two heights. Its area and first moment are
    those of both parts less those of their intersection min(p, r, s, 1−s), which is symmetric
    about one half.
    """
    area: Any = 0.0
    moment: Any = 0.0
    for k in range(len(heights) - 1):
        p, r = heights[k], heights[k + 1]
        if isinstance(p, float) and isinstance(r, float) and p == 0.0 and r == 0.0:
            continue
        z = minimum(minimum(p, r), 0.5)
        common = z * (1.0 - z)
        half_p, half_r = 0.5 * (p * p), 0.5 * (r * r)
        q = 1.0 - p
        a = p * q + half_p + r * (1.0 - r) + half_r - common
        m = (
            0.5 * (p * (q * q))
            + half_p * (1.0 - (2.0 / 3.0) * p)
            + 0.5 * (r * (1.0 - r * r))
            + (r * (r * r)) / 3.0
            - 0.5 * common
        )
        area = area + a
        moment = moment + (m + k * a)
    return output.low + output.width * (moment / area)
