"""PID on the speed error, with feed-forward."""

import random

import pytest

from railcosim.controllers import SpeedPID
from tests.tracing import largest_difference


def test_by_hand() -> None:
    law = SpeedPID(kp=0.5, ki=0.1, kd=0.2, mass=1.25)
    u, x = law.step(law.start(), 9.0, 0.3, -0.7, 0.05)  # no derivative at the first sample
    assert u == pytest.approx(1.25 * -0.65 - 0.15 - 0.1 * 0.06)
    u, x = law.step(x, 9.0, 0.1, -0.7, 0.05)
    assert u == pytest.approx(1.25 * -0.65 - 0.05 - 0.1 * 0.08 + 0.2)


def test_the_position_error_is_not_used() -> None:
    law = SpeedPID(kp=0.5, ki=0.1)
    assert law.step(law.start(), 1.0, 0.1, 0.0, 0.0) == law.step(law.start(), 7.0, 0.1, 0.0, 0.0)


def test_the_integral_removes_a_constant_disturbance() -> None:
    law = SpeedPID(kp=1.0, ki=0.5)
    x, rate, u = law.start(), 0.0, 0.0
    for _ in range(400):
        u, x = law.step(x, 0.0, rate, 0.0, 0.0)
        rate += 0.2 * (u / law.mass + 0.1)
    assert rate == pytest.approx(0.0, abs=1e-9)
    assert u == pytest.approx(-0.1 * law.mass)


def test_traced_is_the_same() -> None:
    law, generator = SpeedPID(kp=0.5, ki=0.1, kd=0.2), random.Random(4)
    states = [
        (generator.uniform(-2, 2), generator.uniform(-2, 2), float(generator.random() < 0.2))
        for _ in range(1000)
    ]
    points = [tuple(generator.uniform(-2.0, 2.0) for _ in range(4)) for _ in states]
    assert largest_difference(law, states, points) <= 1e-12
