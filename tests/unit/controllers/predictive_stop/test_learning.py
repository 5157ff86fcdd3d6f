"""Learning from stop to stop: against a Kalman filter over the whole state; the cheap trim."""

import numpy as np
import pytest

from railcosim.controllers.predictive_stop import Learning, PredictiveStop, Prior, trimmed
from railcosim.controllers.predictive_stop.cheap_stop import cheap_stop

NOMINAL = Prior.nominal(changeover_speed=6.0 / 3.6, fade_rate=0.60, scale=0.007)
LEARNT = 11  # parameters that are learnt


def test_begins_with_the_nominal_prior() -> None:
    prior = Learning.begin(NOMINAL).prior
    assert prior.mean == NOMINAL.mean
    assert np.array(prior.covariance) == pytest.approx(np.array(NOMINAL.covariance), rel=1e-12)


def test_agrees_with_the_textbook() -> None:
    """Three stops, each of which measures y = C θ + n: the filter over (x_1, x_2, θ) itself."""
    generator = np.random.default_rng(1)
    learning = Learning.begin(NOMINAL)
    sd = np.array(NOMINAL.deviations)
    n = len(sd)
    H = np.hstack([np.eye(n), np.eye(n)])
    x, P = np.zeros(2 * n), np.array(learning.covariance)
    A = np.diag(np.repeat(learning.kept, n))
    Q = np.array(learning.covariance) - A @ np.array(learning.covariance) @ A.T
    W = np.array(learning.rest)
    for _ in range(3):
        C = generator.standard_normal((6, n)) / sd
        R = np.diag(generator.uniform(0.01, 0.5, 6))
        y = C @ np.array(NOMINAL.mean) + generator.standard_normal(6)
        # what the stop's own estimation gives, from the prior of θ alone
        prior = learning.prior
        m, M = np.array(prior.mean), np.array(prior.covariance)
        gain = M @ C.T @ np.linalg.inv(C @ M @ C.T + R)
        learning = learning.updated(m + gain @ (y - C @ m), M - gain @ C @ M)
        # Kalman: y measures the parts through H, with C W Cᵀ + R for noise
        D = C @ H
        gain = P @ D.T @ np.linalg.inv(D @ P @ D.T + C @ W @ C.T + R)
        x = x + gain @ (y - C @ np.array(NOMINAL.mean) - D @ x)
        P = P - gain @ D @ P
        x, P = A @ x, A @ P @ A.T + Q
        scale = np.tile(sd, 2)
        assert np.array(learning.estimate) / scale == pytest.approx(x / scale, abs=1e-8)
        found = np.array(learning.covariance) / np.outer(scale, scale)
        assert found == pytest.approx(P / np.outer(scale, scale), abs=1e-8)
    assert learning.stops == 3
    assert learning.prior.mean[LEARNT:] == NOMINAL.mean[LEARNT:]


def test_knows_more_after_a_stop() -> None:
    learning = Learning.begin(NOMINAL)
    exact = np.array(NOMINAL.covariance) * 1e-4
    mean = np.array(NOMINAL.mean) + 0.5 * np.array(NOMINAL.deviations)
    for _ in range(20):
        learning = learning.updated(mean, exact)
    prior = learning.prior
    share = np.array(prior.deviations)[:LEARNT] / np.array(NOMINAL.deviations)[:LEARNT]
    assert (share < 0.85).all()
    moved = (np.array(prior.mean) - NOMINAL.mean)[:LEARNT] / np.array(NOMINAL.deviations)[:LEARNT]
    assert (moved > 0.3).all()
    assert (moved < 0.5).all()


def test_trim_of_the_aim() -> None:
    controller = cheap_stop(NOMINAL)
    assert isinstance(controller, PredictiveStop)
    assert trimmed(controller, 0.1).plan.aim == pytest.approx(-0.02)
    assert trimmed(trimmed(controller, -0.1), 5.0).plan.aim == pytest.approx(0.02 - 0.06)
