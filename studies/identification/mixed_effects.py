"""Least squares for runs that differ: common parameters, and how each varies from run to run."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

FEWEST = 4  # brakings from which a spread can be told
MOST = 60  # evaluations, each with its sensitivities
SETTLED = 0.02  # standard errors by which the mean may still move
CHANGE = 0.1  # by which the logarithm of a variance may still change
LEAST_SPREAD = 1e-4  # of a parameter's size
UNTOLD = 0.8  # share of a spread that the runs leave open: above, it is not known
LARGEST_MOVE = 0.3  # of a parameter's size, in one step


@dataclass(frozen=True, kw_only=True, eq=False)
class MixedEffects:
    """What varies and how much.

    `mean` of the parameters over all trains like these, with its `covariance`; `spread`, their
    standard deviation from run to run, NaN where the runs do not tell it; `noise` (m/s), the
    standard deviation of the measured speed about each run's own model; `runs`, each run's
    parameters (run, parameter).
    """

    mean: np.ndarray
    covariance: np.ndarray
    spread: np.ndarray
    noise: float
    runs: np.ndarray
    evaluations: int
    settled: bool


class _Run(NamedTuple):
    """One run's errors and derivatives, and its information about its own parameters."""

    errors: np.ndarray
    jacobian: np.ndarray
    posterior: np.ndarray


def mixed_effects(
    errors_and_jacobian: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    low: np.ndarray,
    high: np.ndarray,
    *,
    start: np.ndarray,
    run_of_sample: np.ndarray,
    most: int = MOST,
) -> MixedEffects:
    """Return the mean and spread of parameters that differ from run to run.

    Run l has θ_l ~ N(θ, Ω), Ω diagonal, and measured speeds y_l = f(θ_l) + noise. Each evaluation
    takes a row of parameters for every run; with its sensitivities the model is linear about
    them. From that follow θ (generalised least squares, each run's errors weighted by the inverse
    of σ² I + J Ω Jᵀ), each θ_l (its posterior mean) and, by expectation and maximisation, Ω and
    σ²: the first-order conditional estimates of nonlinear mixed-effects models (Lindstrom and
    Bates, 1990). Plain least squares counts a run's errors as independent; they are not, since a
    run that brakes harder does so throughout, and the delays then bear what is the runs' spread.
    """
    size = np.maximum(np.abs(start), 0.05 * (high - low))
    runs = int(run_of_sample[-1]) + 1
    members = [run_of_sample == k for k in range(runs)]
    mean, own = start.copy(), np.tile(start, (runs, 1))
    variances, noise = (0.1 * size) ** 2, 0.05**2
    covariance, settled, count = np.diag(variances), False, 0
    found: list[_Run] = []
    before = variances
    while count < most and not settled:
        errors, jacobian = errors_and_jacobian(own)
        count += 1
        parts = [(errors[rows], jacobian[rows]) for rows in members]
        found, covariance, right = _common(parts, own, variances, noise)
        wanted = np.clip(covariance @ right, low, high)
        move = np.clip(wanted - mean, -LARGEST_MOVE * size, LARGEST_MOVE * size)
        mean = mean + move
        before = variances
        own, variances, noise = _runs(found, own, mean, variances, noise, (low, high))
        variances = np.maximum(variances, (LEAST_SPREAD * size) ** 2)
        margin = SETTLED * np.sqrt(np.maximum(np.diag(covariance), 0.0))
        settled = bool(
            np.all(np.abs(move) <= margin + 1e-9 * size)
            and np.all(np.abs(np.log(variances / before)) <= CHANGE)
        )
    left_open = np.mean([np.diag(run.posterior) for run in found], axis=0) / before
    spread = np.where(left_open > UNTOLD, np.nan, np.sqrt(variances))
    return MixedEffects(
        mean=mean, covariance=covariance, spread=spread, noise=float(np.sqrt(noise)),
        runs=own, evaluations=count, settled=settled,
    )  # fmt: skip


def _common(
    parts: list[tuple[np.ndarray, np.ndarray]],
    own: np.ndarray,
    variances: np.ndarray,
    noise: float,
) -> tuple[list[_Run], np.ndarray, np.ndarray]:
    """Return the runs, and of the common parameters the covariance and the right side.

    Jᵀ (σ² I + J Ω Jᵀ)⁻¹ is (I − X V) Jᵀ/σ² with X = JᵀJ/σ² and V = (X + Ω⁻¹)⁻¹.
    """
    size = len(variances)
    information, right, found = np.zeros((size, size)), np.zeros(size), []
    for (e, J), theta in zip(parts, own, strict=True):
        X = J.T @ J / noise
        posterior = np.linalg.inv(X + np.diag(1.0 / variances))
        weight = np.eye(size) - X @ posterior
        information += weight @ X
        right += weight @ (J.T @ (J @ theta - e)) / noise
        found.append(_Run(e, J, posterior))
    return found, np.linalg.pinv(information, hermitian=True), right


def _runs(
    found: list[_Run],
    own: np.ndarray,
    mean: np.ndarray,
    variances: np.ndarray,
    noise: float,
    bounds: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return each run's parameters, their variances about the mean, and the noise's variance."""
    moved, total, squares, count = [], np.zeros(len(mean)), 0.0, 0
    for run, before in zip(found, own, strict=True):
        pull = -run.jacobian.T @ run.errors / noise - (before - mean) / variances
        after = np.clip(before + run.posterior @ pull, *bounds)
        left = run.errors + run.jacobian @ (after - before)
        squares += left @ left + np.sum((run.jacobian @ run.posterior) * run.jacobian)
        count += len(left)
        total += (after - mean) ** 2 + np.diag(run.posterior)
        moved.append(after)
    return np.array(moved), total / len(found), float(squares / count)
