"""How the truth drifts: each stop alone is as an independent one; neighbours are alike."""

import numpy as np
import pytest
from scipy import stats

from railcosim.studies.precise_braking.drift import BENIGN, DRIFTS, HARSH
from railcosim.studies.precise_braking.truth import V6


def truths(name: str, attribute: str, *, lag: int, chains: int = 1500) -> tuple[np.ndarray, ...]:
    """Return a number at the first stop, and `lag` stops later, of many chains."""
    pairs = []
    for k in range(chains):
        chain = list(DRIFTS[name].chain(V6, np.random.default_rng([k, 7]), lag + 1))
        pairs.append((getattr(chain[0], attribute), getattr(chain[-1], attribute)))
    return tuple(np.array(pairs).T)


@pytest.mark.parametrize(
    ("name", "attribute", "half", "shares"),
    [
        ("benign", "mass_ratio", 0.06, BENIGN.mass),
        ("harsh", "air_gain", 0.10, HARSH.friction),
        ("harsh", "air_lag", 0.20, HARSH.others),
    ],
)
def test_spread_and_correlation(
    name: str, attribute: str, half: float, shares: tuple[float, float, float]
) -> None:
    first, later = truths(name, attribute, lag=4)
    middle = getattr(V6, attribute)
    for values in (first, later):
        uniform = stats.uniform(middle * (1.0 - half), 2.0 * half * middle)
        assert stats.kstest(values, uniform.cdf).pvalue > 1e-3
    slow, daily, _ = shares
    normal = slow * 0.998**4 + daily * 0.85**4
    expected = 6.0 / np.pi * np.arcsin(normal / 2.0)  # of uniforms driven by such normals
    assert np.corrcoef(first, later)[0, 1] == pytest.approx(expected, abs=0.08)


def test_speed_is_of_each_stop_alone() -> None:
    first, later = truths("benign", "speed", lag=1)
    assert abs(np.corrcoef(first, later)[0, 1]) < 0.1
    assert np.abs(first - 14.0).max() <= 0.3
