"""The fruit fly optimisation algorithm."""

from collections.abc import Callable

import numpy as np

from .search import Found

Function = Callable[[np.ndarray], float]


def fruit_fly(
    function: Function,
    low: np.ndarray,
    high: np.ndarray,
    *,
    evaluations: int,
    seed: int,
    flies: int = 20,
) -> Found:
    """Return the least value of a function in a box that the fruit flies find.

    Pan, "A new fruit fly optimization algorithm: taking the financial distress model as an
    example" (2012). For each dimension a swarm sits at a place (X, Y), at first in [0, 10]². Each
    fly searches from there, by up to 1 in X and Y, and smells at S = 1/√(X² + Y²); the swarm moves
    to the best fly so far. S is always positive, and far from the origin a step hardly changes it:
    the algorithm searches small S first and finely, large S coarsely. Its S from 0 to 1 is mapped
    onto the box from `low` to `high`; beyond 1 it counts as 1. The mapping is our choice, the
    bias to the lower bounds is the algorithm's.
    """
    generator = np.random.default_rng(seed)
    size = len(low)
    swarm = 10.0 * generator.random((2, size))
    best, value, count, history = low, np.inf, 0, []
    while count < evaluations:
        places = []
        for _ in range(min(flies, evaluations - count)):
            place = swarm + generator.uniform(-1.0, 1.0, (2, size))
            smell = np.minimum(1.0 / np.maximum(np.hypot(*place), 1e-12), 1.0)
            point = low + (high - low) * smell
            places.append((float(function(point)), len(places), place, point))
            count += 1
        nearest = min(places, key=lambda p: p[:2])
        if nearest[0] < value:
            value, _, swarm, best = nearest
        history.append((count, value))
    return Found(best, value, count, tuple(history))
