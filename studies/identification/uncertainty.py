"""How far logs determine parameters: covariance, singular values, and what they leave open."""

from dataclasses import dataclass

import numpy as np

STRONG = 0.95  # |correlation| from which two parameters are said to hang together
LOST = 1e-9  # singular value, over the largest: below, a direction changes nothing at all
SHARE = 0.3  # of a direction: smaller parts are not named


@dataclass(frozen=True, kw_only=True, eq=False)
class Uncertainty:
    """What a Jacobian (sample, parameter) of the speeds says of the parameters.

    `covariance` and with it `standard_errors` are NaN where a direction is lost. `correlation` is
    that of independent errors of one size: the model's own, whatever the errors are.
    `singular_values` in cm/s: how much the speed changes, root mean square over the samples, when
    all parameters change along a column of `directions`, in shares of their sizes. `basis` says
    what the covariance was made from.
    """

    symbols: tuple[str, ...]
    covariance: np.ndarray
    correlation: np.ndarray
    singular_values: np.ndarray
    directions: np.ndarray
    basis: str

    @property
    def standard_errors(self) -> np.ndarray:
        """The parameters' standard errors, in their units."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def condition(self) -> float:
        """The largest singular value over the smallest; inf if that is none."""
        least = self.singular_values[-1]
        return float(self.singular_values[0] / least) if least > 0.0 else float("inf")

    def correlated(self) -> list[tuple[str, str, float]]:
        """Return the pairs of parameters that logs hardly tell apart, the closest first."""
        n = len(self.symbols)
        pairs = [
            (self.symbols[i], self.symbols[j], float(self.correlation[i, j]))
            for i in range(n)
            for j in range(i + 1, n)
            if abs(self.correlation[i, j]) >= STRONG
        ]
        return sorted(pairs, key=lambda p: -abs(p[2]))

    def lost(self) -> list[str]:
        """Return the directions that change nothing, in words."""
        return [
            self.direction(i)
            for i, value in enumerate(self.singular_values)
            if value <= LOST * self.singular_values[0]
        ]

    def direction(self, column: int) -> str:
        """Return a direction in words: "T1 + 0.52 T2 − 0.31 K", of relative changes."""
        parts = self.directions[:, column]
        order = np.argsort(-np.abs(parts).round(6), kind="stable")
        shares = parts / parts[order[0]]
        words = ""
        for i in order:
            size = abs(shares[i])
            if size < SHARE:
                break
            number = "" if abs(size - 1.0) < 0.005 else f"{size:.2f} "
            sign = ("− " if shares[i] < 0.0 else "+ ") if words else ""
            words += f"{' ' if words else ''}{sign}{number}{self.symbols[i]}"
        return words


def uncertainty(
    symbols: tuple[str, ...],
    jacobian: np.ndarray,
    errors: np.ndarray,
    *,
    size: np.ndarray,
    log_of_sample: np.ndarray | None = None,
) -> Uncertainty:
    """Return the uncertainty of parameters fitted by least squares.

    `size` (positive) is what a parameter's changes are measured by: mostly its value.
    The covariance is s² (JᵀJ)⁻¹ with s² the errors' mean square for their degrees of freedom: the
    textbook's, for independent errors. With `log_of_sample` and two more logs than parameters it
    is (JᵀJ)⁻¹ (Σ gₗ gₗᵀ) (JᵀJ)⁻¹ n/(n − 1) with gₗ = Jₗᵀ eₗ of each log: errors may hang together
    within a log, which those of a free run do.
    """
    count, free = jacobian.shape
    scaled = jacobian * size
    _, singular, rows = np.linalg.svd(scaled, full_matrices=False)
    lost = singular <= LOST * singular[0]
    inverse = _inverse(size, singular, rows, lost)
    degrees = max(count - free, 1)
    basis = "independent errors"
    covariance = inverse * float(errors @ errors) / degrees
    logs = 0 if log_of_sample is None else int(log_of_sample[-1]) + 1
    if log_of_sample is not None and logs >= free + 2:
        slopes = np.array(
            [jacobian[rows].T @ errors[rows] for rows in (log_of_sample == k for k in range(logs))]
        )
        covariance = inverse @ (slopes.T @ slopes) @ inverse * logs / (logs - 1)
        basis = f"the scatter between {logs} brakings"
    open_ = np.any(np.abs(rows[lost]) > 1e-6, axis=0) if lost.any() else np.zeros(free, dtype=bool)
    covariance[open_, :] = covariance[:, open_] = np.nan
    return Uncertainty(
        symbols=symbols,
        covariance=covariance,
        correlation=_correlation(inverse),
        singular_values=100.0 * singular / np.sqrt(count),
        directions=rows.T,
        basis=basis,
    )


def _inverse(
    size: np.ndarray, singular: np.ndarray, rows: np.ndarray, lost: np.ndarray
) -> np.ndarray:
    """Return (JᵀJ)⁻¹ in the directions that are not lost, by the scaled singular values."""
    turned = rows[~lost].T * size[:, None] / singular[~lost]
    return turned @ turned.T


def _correlation(covariance: np.ndarray) -> np.ndarray:
    deviations = np.sqrt(np.diag(covariance))
    deviations = np.where(deviations > 0.0, deviations, 1.0)
    return covariance / np.outer(deviations, deviations)
