"""An improved fruit fly algorithm."""

import numpy as np

from .fruit_fly import Function
from .search import Found

WIDEST = 0.5  # of the box
NARROWEST = 1e-3


def improved_fruit_fly(
    function: Function,
    low: np.ndarray,
    high: np.ndarray,
    *,
    evaluations: int,
    seed: int,
    flies: int = 5,
) -> Found:
    """Return the least value of a function in a box that improved fruit flies find.

    Ours: the precise braking paper uses "the improved fruit fly algorithm" and describes none. The
    flies search in the parameters themselves. Each leaves the swarm's place in one random
    dimension only, by up to a radius that decays geometrically, from half the box to 1e-3 of it;
    the swarm moves to the best fly if that is better than where it is.
    """
    generator = np.random.default_rng(seed)
    width = high - low
    best = low + width * generator.random(len(low))
    value, count = float(function(best)), 1
    history = [(count, value)]
    while count < evaluations:
        radius = WIDEST * (NARROWEST / WIDEST) ** (count / evaluations)
        smelled = []
        for _ in range(min(flies, evaluations - count)):
            point, i = best.copy(), int(generator.integers(len(low)))
            moved = point[i] + radius * width[i] * generator.uniform(-1.0, 1.0)
            point[i] = np.clip(moved, low[i], high[i])
            smelled.append((float(function(point)), len(smelled), point))
            count += 1
        nearest = min(smelled, key=lambda s: s[:2])
        if nearest[0] < value:
            value, _, best = nearest
        history.append((count, value))
    return Found(best, value, count, tuple(history))
