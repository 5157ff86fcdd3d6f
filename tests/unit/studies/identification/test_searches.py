"""The searches without derivatives find what is known."""

import numpy as np
import pytest

from railcosim.studies.identification.differential_evolution import differential_evolution
from railcosim.studies.identification.fruit_fly import fruit_fly
from railcosim.studies.identification.improved_fruit_fly import improved_fruit_fly
from railcosim.studies.identification.least_squares import least_squares

LOW, HIGH = np.array([-2.0, 0.0, 1.0]), np.array([2.0, 3.0, 5.0])
BEST = np.array([-1.2, 0.8, 2.1])


def sphere(x: np.ndarray) -> float:
    return float(np.sum(((x - BEST) / (HIGH - LOW)) ** 2))


@pytest.mark.parametrize(
    ("search", "near"),
    [(fruit_fly, 0.05), (improved_fruit_fly, 0.005), (differential_evolution, 0.001)],
)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_find_the_bottom_of_a_sphere(search: object, near: float, seed: int) -> None:
    calls = 0

    def counted(x: np.ndarray) -> float:
        nonlocal calls
        calls += 1
        assert np.all((x >= LOW) & (x <= HIGH))
        return sphere(x)

    found = search(counted, LOW, HIGH, evaluations=1200, seed=seed)  # pyright: ignore[reportCallIssue]
    assert np.max(np.abs(found.point - BEST) / (HIGH - LOW)) < near
    assert found.value == pytest.approx(sphere(found.point), abs=1e-15)
    assert found.evaluations == calls <= 1200
    values = [value for _, value in found.history]
    assert values == sorted(values, reverse=True)
    again = search(sphere, LOW, HIGH, evaluations=1200, seed=seed)  # pyright: ignore[reportCallIssue]
    assert np.array_equal(again.point, found.point)


def test_the_fruit_fly_favours_the_lower_bounds() -> None:
    """Where it matters: S = 1/D hardly changes far from the origin, and leaps near it."""

    def left(best: float) -> float:
        return fruit_fly(
            lambda x: float(np.sum((x - best) ** 2)), np.zeros(2), np.ones(2),
            evaluations=400, seed=7,
        ).value  # fmt: skip

    assert left(0.2) < left(0.95)


def test_least_squares_of_a_straight_line() -> None:
    t = np.linspace(0.0, 1.0, 11)
    y = 0.3 + 1.7 * t
    J = np.column_stack((np.ones(11), t))
    found = least_squares(
        lambda x: (J @ x - y, J), np.zeros(2), 3.0 * np.ones(2), start=np.ones(2)
    )  # fmt: skip
    assert found.point == pytest.approx([0.3, 1.7], abs=1e-8)
    assert found.evaluations < 20
