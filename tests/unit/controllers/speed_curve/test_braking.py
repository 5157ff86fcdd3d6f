"""Braking with bounded jerk in closed form, against the integral of its ramps."""

import numpy as np
import pytest

from railcosim.controllers.speed_curve.braking import braking
from railcosim.controllers.speed_curve.driving import Driving
from railcosim.controllers.speed_curve.goals import goals


@pytest.mark.parametrize("speed", [3.0, 12.0])
@pytest.mark.parametrize("acceleration", [-0.3, 0.0, 0.9])
@pytest.mark.parametrize(("goal", "final"), [(0.0, 0.0), (0.0, 0.25), (2.0, 0.0)])
def test_it_ends_at_the_goal(speed: float, acceleration: float, goal: float, final: float) -> None:
    way = braking(speed, acceleration, goal, jerk=0.5, deceleration=0.7, final=final)
    assert way is not None
    a, v, s, lowest = acceleration, speed, 0.0, 0.0
    for duration, jerk in way.ramps:
        assert duration >= 0.0 and jerk in (-0.5, 0.0, 0.5)
        nodes, weights = np.polynomial.legendre.leggauss(3)
        t = duration * (1.0 + nodes) / 2.0
        s += duration / 2.0 * float(weights @ (v + a * t + jerk * t * t / 2.0))
        v += duration / 2.0 * float(weights @ (a + jerk * t))
        a += jerk * duration
        lowest = min(lowest, a)
    assert (v, a, s) == pytest.approx((goal, -final, way.distance), abs=1e-12)
    assert lowest >= -0.7 - 1e-12


def test_nothing_to_brake() -> None:
    assert braking(5.0, 0.0, 6.0, jerk=0.5, deceleration=0.7) is None
    assert braking(5.0, 0.5, 5.2, jerk=0.5, deceleration=0.7) is not None  # it would reach 5.25
    assert braking(0.01, 0.0, 0.0, jerk=0.5, deceleration=0.7, final=0.25) is None


def test_a_goal_shortly_before_a_lower_one_is_lowered() -> None:
    found = goals([(0.0, 22.0), (500.0, 15.0), (520.0, 10.0)], 1000.0, Driving())
    assert [g.position for g in found] == [500.0, 520.0, 1000.0]
    assert 10.0 < found[0].speed < 15.0 and found[1].speed == 10.0
    assert found[1].overrun(500.0, found[0].speed, 0.0) == pytest.approx(0.0, abs=1e-9)
