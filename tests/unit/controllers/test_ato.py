"""The ATO: its feed-forward and its predictor against scipy, its feedback's poles, its errors."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from railcosim.base.errors import ParameterError
from railcosim.controllers import ATO
from railcosim.controllers.speed_curve import Course, Response, fast_curve
from railcosim.models.line import SEVEN_RUNS, beijing_line_5, metro_b

TRAIN = metro_b()
SECTION = beijing_line_5().section(*SEVEN_RUNS[0])
COURSE = Course(SECTION, TRAIN)
CURVE = fast_curve(SECTION, TRAIN)
DRIVER = ATO.along(CURVE, COURSE)


def motors(commands: Any, until: float, *, start: float = 0.0) -> np.ndarray:
    """Return the motors' acceleration, and its two integrals, after commands each 0.2 s."""
    found = np.array([start, 0.0, 0.0])
    edges = np.arange(0.0, until + 1e-9, 0.1)  # 0.9 s and 0.2 s are whole numbers of these
    for begin, end in pairwise(edges):
        k = math.floor((begin - 0.9 + 1e-9) / 0.2)
        goal = 0.85 * commands[k] if 0 <= k < len(commands) else 0.0
        found = solve_ivp(
            lambda t, y, goal=goal: [(goal - y[0]) / 0.83, y[0], y[1]], (begin, end), found,
            rtol=1e-10, atol=1e-12,
        ).y[:, -1]  # fmt: skip
    return found


def test_the_feed_forward_makes_the_curve() -> None:
    """The motors driven by it give the curve's acceleration at the samples, up to saturation."""
    for seconds in (8.0, 20.0, 60.0, 72.0):
        count = round(seconds / 0.2)
        at = CURVE.at(seconds + 0.9 - DRIVER.lead)
        wanted = float(at.acceleration + COURSE.resistance(at.speed, at.position))
        assert motors(DRIVER.feed_forward, seconds + 0.9)[0] == pytest.approx(wanted, abs=2e-3)
        assert -1.0 <= DRIVER.feed_forward[count] <= 1.5


def test_the_prediction_against_scipy() -> None:
    given = [0.1, -0.3, 0.5, 0.2, -0.1, 0.4]  # the oldest first
    now = 0.2 * len(given)  # the oldest acts from 0.9 s on: 0.3 s of it lie behind
    before = motors(given, now)
    after = motors(given, now + 0.9)
    predicted = DRIVER._ahead(tuple(reversed(given)), float(before[0]), 0.9)
    assert predicted[0] == pytest.approx(after[0], abs=1e-8)
    assert predicted[1] == pytest.approx(after[1] - before[1], abs=1e-8)
    assert predicted[2] == pytest.approx(after[2] - before[2] - 0.9 * before[1], abs=1e-8)


def test_the_feedback_has_a_triple_pole() -> None:
    """Without delay: ṡ = v, v̇ = b, T2 ḃ = P1 u − b."""
    bare = ATO(curve=CURVE, feed_forward=(0.0,), response=Response(electric_delay=1e-9))
    none = (0.0,) * len(bare.start()[1])
    motor, place, speed = (
        bare._correction(none, *by, 0.0)
        for by in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    )
    lag, gain = 0.83, 0.85
    closed = np.array(
        [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0],
         [gain * place / lag, gain * speed / lag, (gain * motor - 1.0) / lag]]
    )  # fmt: skip
    assert np.poly(closed) == pytest.approx([1.0, 1.5, 0.75, 0.125], abs=1e-6)


def test_on_the_curve_it_commands_the_feed_forward() -> None:
    x = DRIVER.start()
    for k in range(60):
        at = CURVE.at(0.2 * k - DRIVER.lead)
        (command, target), x = DRIVER.step(x, float(at.position), float(at.speed))
        assert target == float(at.speed)
        assert command == pytest.approx(DRIVER.feed_forward[k], abs=0.02)


def test_a_constant_disturbance_is_found() -> None:
    """A train that loses 0.05 m/s² keeps the curve in the end."""
    x, s, v, b = DRIVER.start(), 0.0, 0.0, 0.0
    commands = [0.0] * 10
    for _ in range(330):
        (command, _), x = DRIVER.step(x, s, v)
        commands.append(command)
        for part in (commands[-6], commands[-5]):  # 0.9 s are four and a half periods
            for _ in range(50):
                b += 0.002 * (0.85 * part - b) / 0.83
                net = b - float(COURSE.resistance(v, s)) - (0.05 if v > 0.0 else 0.0)
                v = max(v + 0.002 * net, 0.0)
                s += 0.002 * v
    at = CURVE.at(0.2 * 330 - DRIVER.lead)
    assert float(at.speed) > 20.0
    assert s == pytest.approx(float(at.position), abs=0.03)
    assert v == pytest.approx(float(at.speed), abs=0.02)


def test_it_holds_where_it_has_stopped() -> None:
    x = (600, *DRIVER.start()[1:])
    assert DRIVER.step(x, SECTION.length - 0.1, 0.0)[0] == (-0.5, pytest.approx(0.0, abs=0.5))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"period": 0.0}, "period must be a positive number"),
        ({"lead": -1.0}, "lead must not be negative"),
        ({"holding": 0.5}, "holding must brake"),
        ({"feed_forward": ()}, "feed_forward needs a command"),
        ({"limits": (1.0, -1.0)}, "low < high"),
        ({"curve": None}, "curve must be a SpeedCurve"),
    ],
)
def test_what_cannot_be(change: dict[str, Any], says: str) -> None:
    with pytest.raises(ParameterError, match=says):
        ATO(**{"curve": CURVE, "feed_forward": (0.0,), **change})
    with pytest.raises(ParameterError, match="air_lag must be positive"):
        Response(air_lag=0.0)
