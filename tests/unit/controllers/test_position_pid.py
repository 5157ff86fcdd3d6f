"""PID on the position error, with feed-forward."""

import random

import pytest

from railcosim.controllers import PositionPID
from tests.tracing import largest_difference


def test_by_hand() -> None:
    law = PositionPID(kp=0.5, ki=0.1, kd=0.8, mass=1.25)
    u, x = law.step(law.start(), 2.0, 0.3, -0.7, 0.05)
    assert u == pytest.approx(1.25 * -0.65 - 1.0 - 0.1 * 0.4 - 0.24)
    assert x == pytest.approx(0.4)


def test_the_integral_removes_a_constant_disturbance() -> None:
    law = PositionPID(kp=0.5, ki=0.05, kd=1.0)
    x, e, rate = law.start(), 0.5, 0.0
    for _ in range(1500):
        u, x = law.step(x, e, rate, 0.0, 0.0)
        e, rate = e + 0.2 * rate, rate + 0.2 * (u / law.mass + 0.1)
    assert (e, rate) == (pytest.approx(0.0, abs=1e-9), pytest.approx(0.0, abs=1e-9))


def test_traced_is_the_same() -> None:
    law, generator = PositionPID(kp=0.5, ki=0.1, kd=0.2), random.Random(4)
    states = [generator.uniform(-2.0, 2.0) for _ in range(1000)]
    points = [tuple(generator.uniform(-2.0, 2.0) for _ in range(4)) for _ in states]
    assert largest_difference(law, states, points) <= 1e-12
