"""The sliding mode: in an ideal loop the surface is reached when it must be, and kept."""

import math
import random
from typing import Any

import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers import SlidingMode
from tests.tracing import largest_difference

LAW = SlidingMode(surface=0.5, reaching=0.0, robust=0.2, mass=1.3)


def test_by_hand() -> None:
    law = SlidingMode(surface=0.5, reaching=0.1, robust=0.2, mass=1.25)
    # z = 0.5 · 2 − 0.4 = 0.6, q = −0.7 + 0.5 · 0.4 + 0.05 = −0.45
    u, _ = law.step((), 2.0, -0.4, -0.7, 0.05)
    assert u == pytest.approx(1.25 * -0.45 - 0.06 - 0.2)
    soft = SlidingMode(surface=0.5, reaching=0.1, robust=0.2, mass=1.25, boundary=1.2)
    assert soft.step((), 2.0, -0.4, -0.7, 0.05)[0] == pytest.approx(1.25 * -0.45 - 0.06 - 0.1)


def test_on_the_surface_it_does_not_switch() -> None:
    assert LAW.step((), 0.0, 0.0, -0.7, 0.05)[0] == pytest.approx(1.3 * -0.65)


@pytest.mark.parametrize("disturbance", [-0.1, 0.0, 0.1])
def test_the_surface_is_reached_in_the_ideal_loop(disturbance: float) -> None:
    """θ z' = −η sgn(z) + Δ exactly, so z is 0 after θ |z0|/(η − Δ sgn(z0)) and stays there.

    Without the term in q: the loop is θ v' = u − θ r + Δ with no delay, r and a_d constant.
    """
    dt, e, rate = 1e-4, 1.0, 0.3
    a_d, r = -0.7, 0.04
    z0 = LAW.surface * e + rate
    reached = LAW.mass * z0 / (LAW.robust - disturbance)
    for _ in range(math.ceil(reached / dt)):
        u, _ = LAW.step((), e, rate, a_d, r)
        acceleration = u / LAW.mass - r + disturbance / LAW.mass
        e += rate * dt
        rate += (acceleration - a_d) * dt
    z = LAW.surface * e + rate
    assert abs(z) < 1e-3
    for _ in range(20_000):
        u, _ = LAW.step((), e, rate, a_d, r)
        e += rate * dt
        rate += (u / LAW.mass - r + disturbance / LAW.mass - a_d) * dt
        assert abs(LAW.surface * e + rate) < 1e-4


def test_on_the_surface_the_error_decays_as_the_surface_says() -> None:
    dt, e, a_d = 1e-4, 1.0, -0.7
    rate = -LAW.surface * e
    for _ in range(40_000):
        u, _ = LAW.step((), e, rate, a_d, 0.0)
        e, rate = e + rate * dt, rate + (u / LAW.mass - a_d) * dt
    assert e == pytest.approx(math.exp(-LAW.surface * 4.0), abs=1e-3)


@pytest.mark.parametrize("boundary", [None, 0.3])
def test_traced_is_the_same(boundary: float | None) -> None:
    law = SlidingMode(surface=0.4, reaching=0.1, robust=0.2, boundary=boundary)
    generator = random.Random(3)
    points = [tuple(generator.uniform(-2.0, 2.0) for _ in range(4)) for _ in range(2000)]
    points += [(0.0, 0.0, -0.7, 0.0), (1.0, -0.4, 0.0, 0.0)]
    assert largest_difference(law, [()] * len(points), points) <= 1e-12


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"mass": 0.0}, "mass must be a positive number"),
        ({"boundary": 0.0}, "boundary must be a positive number"),
        ({"robust": math.inf}, "robust must be a finite number"),
    ],
)
def test_wrong_parameters_are_refused(options: Any, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        SlidingMode(**{"surface": 0.4, "reaching": 0.1, "robust": 0.2, **options})
