"""The disturbance observer finds a constant disturbance, at the rate that it should."""

import random
from typing import Any

import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers import DisturbanceObserver
from tests.tracing import largest_difference


def observed(observer: DisturbanceObserver, disturbance: float, share: float) -> Any:
    """Let a point mass under the disturbance be predicted by a model that adds what is observed."""
    found = x = observer.start()
    speed = 0.0
    for _ in range(400):
        predicted = speed + observer.period * found
        speed += observer.period * disturbance
        found, x = observer.step(x, speed, predicted, share)
    return found


@pytest.mark.parametrize("disturbance", [-0.12, 0.03])
@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_a_constant_disturbance_is_found(disturbance: float, share: float) -> None:
    observer = DisturbanceObserver(gain=0.1, air_gain=0.3)
    assert observed(observer, disturbance, share) == pytest.approx(disturbance, abs=1e-12)


@pytest.mark.parametrize(("share", "rate"), [(1.0, 0.05), (0.5, 0.15), (0.0, 0.25)])
def test_it_comes_closer_by_its_gain_at_each_sample(share: float, rate: float) -> None:
    observer = DisturbanceObserver(gain=0.05, air_gain=0.2)
    found = x = observer.start()
    for k in range(1, 20):
        found, x = observer.step(x, 1.0 + 0.2 * 0.08, 1.0 + 0.2 * found, share)
        assert found == pytest.approx(0.08 * (1.0 - (1.0 - rate) ** k), abs=1e-12)


def test_it_is_limited() -> None:
    assert observed(DisturbanceObserver(gain=0.1, limit=0.05), 1.0, 1.0) == 0.05


def test_traced_is_the_same() -> None:
    observer = DisturbanceObserver(gain=0.1, air_gain=0.2, limit=0.2)
    generator = random.Random(8)
    states = [generator.uniform(-0.2, 0.2) for _ in range(1000)]
    points = [(generator.uniform(-1, 1), generator.uniform(-1, 1), generator.random())
              for _ in states]  # fmt: skip
    assert largest_difference(observer, states, points) <= 1e-12


@pytest.mark.parametrize("name", ["gain", "air_gain"])
def test_wrong_gains_are_refused(name: str) -> None:
    with pytest.raises(ParameterError, match=f"{name} must be a share from 0 to 1, not 1.5"):
        DisturbanceObserver(**{"gain": 0.1, name: 1.5})
