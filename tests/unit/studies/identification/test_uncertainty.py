"""Covariances against the textbook and Monte Carlo, and directions that are lost."""

import numpy as np
import pytest

from railcosim.studies.identification.mixed_effects import mixed_effects
from railcosim.studies.identification.uncertainty import uncertainty


def test_of_a_straight_line_as_the_textbook_has_it() -> None:
    generator = np.random.default_rng(0)
    t = np.linspace(0.0, 4.0, 30)
    errors = generator.standard_normal(30)
    J = np.column_stack((np.ones(30), t))
    found = uncertainty(("a", "b"), J, errors, size=np.array([2.0, 0.5]))
    spread = np.sum((t - t.mean()) ** 2)
    variance = np.sum(errors**2) / 28
    assert found.standard_errors[1] == pytest.approx(np.sqrt(variance / spread))
    assert found.standard_errors[0] == pytest.approx(
        np.sqrt(variance * (1 / 30 + t.mean() ** 2 / spread))
    )
    correlation = -t.mean() / np.sqrt(np.mean(t**2))
    assert found.correlation[0, 1] == pytest.approx(correlation)
    wanted = 100.0 * np.linalg.svd(J * [2.0, 0.5], compute_uv=False) / np.sqrt(30)
    assert found.singular_values == pytest.approx(wanted)


def test_two_factors_of_one_product_are_lost_and_the_rest_is_not() -> None:
    generator = np.random.default_rng(1)
    a, b = generator.standard_normal((2, 50))
    J = np.column_stack((b, a / 2.0, -3.0 * a / 4.0))  # y = … K1/K2 at K1 = 2·…, relative: equal
    size = np.array([1.0, 2.0, 4.0 / 3.0])
    found = uncertainty(("c", "K1", "K2"), J, 0.1 * a, size=size)
    assert found.singular_values[-1] < 1e-12 * found.singular_values[0]
    (words,) = found.lost()
    assert words in ("K1 + K2", "K2 + K1")
    assert np.isfinite(found.standard_errors[0])
    assert np.isnan(found.standard_errors[1:]).all()
    assert found.condition > 1e12
    assert ("K1", "K2") in [pair[:2] for pair in found.correlated()]


def test_errors_that_hang_together_within_a_log() -> None:
    """The slope's true scatter, by Monte Carlo, when each log has an error of its own."""
    generator = np.random.default_rng(2)
    logs, each = 30, 20
    group = np.repeat(np.arange(logs), each)
    t = np.tile(np.linspace(0.0, 1.0, each), logs)
    J = t[:, None]
    slopes, told, naive = [], [], []
    for _ in range(300):
        y = generator.standard_normal(logs)[group] * t + 0.1 * generator.standard_normal(len(t))
        slope = float(t @ y / (t @ t))
        slopes.append(slope)
        errors = J[:, 0] * slope - y
        size = np.ones(1)
        told.append(uncertainty(("b",), J, errors, size=size, log_of_sample=group).standard_errors)
        naive.append(uncertainty(("b",), J, errors, size=size).standard_errors)
    assert np.mean(told) == pytest.approx(np.std(slopes), rel=0.1)
    assert np.mean(naive) < 0.4 * np.std(slopes)


def test_mixed_effects_of_straight_lines() -> None:
    """A balanced linear model: the mean is that of each run's own fit, and so is its error."""
    generator = np.random.default_rng(3)
    runs, each = 40, 25
    group = np.repeat(np.arange(runs), each)
    t = np.tile(np.linspace(0.0, 2.0, each), runs)
    true = np.array([1.0, 2.0]) + generator.standard_normal((runs, 2)) * [0.3, 0.1]
    y = true[group, 0] + true[group, 1] * t + 0.05 * generator.standard_normal(len(t))
    J = np.column_stack((np.ones(len(t)), t))

    def errors_and_jacobian(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.sum(J * rows[group], axis=1) - y, J

    found = mixed_effects(
        errors_and_jacobian, np.full(2, -9.0), np.full(2, 9.0), start=np.ones(2),
        run_of_sample=group,
    )  # fmt: skip
    own = np.array(
        [np.linalg.lstsq(J[group == k], y[group == k], rcond=None)[0] for k in range(runs)]
    )
    assert found.settled
    assert found.mean == pytest.approx(own.mean(axis=0), abs=2e-3)
    assert found.noise == pytest.approx(0.05, rel=0.05)
    assert found.spread == pytest.approx([0.3, 0.1], rel=0.25)
    scatter = own.std(axis=0, ddof=1) / np.sqrt(runs)
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(scatter, rel=0.1)
