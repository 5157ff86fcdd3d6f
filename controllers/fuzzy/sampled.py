"""The centre of gravity from 101 points, as Simulink's toolbox takes it."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from ...base.ops import maximum, minimum
from .sets import Triangles, UniformSets

SAMPLES = 101  # of the Simulink Fuzzy Logic Toolbox


def sampled_centroid(output: UniformSets, heights: Sequence[Any]) -> Any:
    """Return the centre of gravity from 101 equally spaced points of the universe."""
    area: Any = 0.0
    moment: Any = 0.0
    span, last = output.high - output.low, SAMPLES - 1
    for i, applying in enumerate(_memberships(output)):
        degree: Any = None
        for k, membership in applying:
            part = minimum(heights[k], membership)
            degree = part if degree is None else maximum(degree, part)
        area = area + degree
        moment = moment + degree * (output.low + span * i / last)
    return moment / area


@lru_cache
def _memberships(output: UniformSets) -> list[list[tuple[int, float]]]:
    """Return, for every point, the sets that apply there and by how much."""
    count, last = len(output.labels), SAMPLES - 1
    found: list[list[tuple[int, float]]] = []
    for i in range(SAMPLES):
        if isinstance(output, Triangles):
            k, rest = divmod(i * (count - 1), last)
            s = rest / last
            found.append([(k, 1.0 - s), (k + 1, s)] if rest else [(k, 1.0)])
        else:
            found.append(list(enumerate(output.degrees(i * (count - 1) / last))))
    return found
