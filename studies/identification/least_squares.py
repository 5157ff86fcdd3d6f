"""Least squares over all logs at once, with the plant's sensitivities."""

from collections.abc import Callable

import numpy as np

from .search import Found

TOLERANCE = 1e-9
MOST = 100  # evaluations, each with its sensitivities


def least_squares(
    errors_and_jacobian: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    low: np.ndarray,
    high: np.ndarray,
    *,
    start: np.ndarray,
    most: int = MOST,
) -> Found:
    """Return the parameters with the least sum of squared errors near `start`, within bounds.

    scipy's trust-region reflective method; each evaluation gives the errors and their
    derivatives. `value` is the root mean square of the errors.
    """
    from scipy.optimize import least_squares as solve

    seen: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}
    history: list[tuple[int, float]] = []

    def both(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        key = x.tobytes()
        if key not in seen:
            seen[key] = errors_and_jacobian(x)
            root = float(np.sqrt(np.mean(seen[key][0] ** 2)))
            history.append((len(seen), min([root, *(v for _, v in history[-1:])])))
        return seen[key]

    scale = np.maximum(np.abs(start), 0.05 * (high - low))
    result = solve(
        lambda x: both(x)[0], np.clip(start, low, high), jac=lambda x: both(x)[1],  # pyright: ignore
        bounds=(low, high), x_scale=scale, method="trf", ftol=TOLERANCE, xtol=TOLERANCE,
        gtol=TOLERANCE, max_nfev=most,
    )  # fmt: skip
    root = float(np.sqrt(np.mean(result.fun**2)))
    return Found(np.asarray(result.x), root, len(seen), tuple(history))
