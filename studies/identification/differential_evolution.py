"""Differential evolution, as scipy has it."""

import numpy as np

from .fruit_fly import Function
from .search import Found

PER_PARAMETER = 5  # members of the population


def differential_evolution(
    function: Function, low: np.ndarray, high: np.ndarray, *, evaluations: int, seed: int
) -> Found:
    """Return the least value of a function in a box that differential evolution finds.

    Storn and Price's best/1/bin with scipy's settings, five members for each parameter, as many
    generations as the evaluations allow, and no polishing.
    """
    from scipy.optimize import differential_evolution as evolve

    size = len(low)
    members = max(5, PER_PARAMETER * size)
    generations = max(evaluations // members - 1, 0)
    count, best, history = 0, np.inf, []

    def counted(point: np.ndarray) -> float:
        nonlocal count, best
        count += 1
        value = float(function(point))
        if value < best:
            best = value
        if count % members == 0:
            history.append((count, best))
        return value

    result = evolve(
        counted, list(zip(low, high, strict=True)), popsize=max(1, members // size),
        maxiter=generations, polish=False, tol=0.0, atol=0, init="latinhypercube",
        rng=np.random.default_rng(seed),
    )  # fmt: skip
    return Found(np.asarray(result.x), float(result.fun), count, tuple(history))
