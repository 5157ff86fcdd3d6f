"""Speed curves as values: evaluation, energy, regimes, and what the check finds."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp
from scipy.optimize import brentq

from railcosim.base.errors import ParameterError
from railcosim.controllers.speed_curve import Course, Driving, SpeedCurve, fast_curve

from .trains import METRO, VARIED, section

CURVE = fast_curve(VARIED, METRO)


def test_position_and_speed_are_the_integrals_of_the_acceleration() -> None:
    times = np.union1d(CURVE.time, np.arange(0.0, CURVE.running_time, 2e-3))
    at = CURVE.at(times)
    speed = cumulative_trapezoid(at.acceleration, times, initial=0.0)
    assert np.abs(speed - at.speed).max() < 1e-9
    position = cumulative_trapezoid(at.speed, times, initial=0.0)
    assert np.abs(position - at.position).max() < 1e-4


def test_by_position_is_the_inverse_of_by_time() -> None:
    places = np.linspace(0.0, VARIED.length, 1234)
    at = CURVE.at_position(places)
    assert np.abs(at.position - places).max() < 1e-10
    again = CURVE.at(at.time)
    assert np.abs(again.position - places).max() < 1e-9
    assert np.abs(again.speed - at.speed).max() < 1e-9
    middle = brentq(lambda t: float(CURVE.at(t).position) - 1500.0, 0.0, CURVE.running_time)
    assert float(CURVE.at_position(1500.0).time) == pytest.approx(middle, abs=1e-9)


def test_outside_the_train_stands() -> None:
    assert float(CURVE.at(-3.0).position) == 0.0 and float(CURVE.at(-3.0).speed) == 0.0
    assert float(CURVE.at(1e4).position) == VARIED.length and float(CURVE.at(1e4).speed) == 0.0
    assert float(CURVE.at_position(VARIED.length + 5.0).time) == CURVE.running_time


def test_energy_is_the_tractions_work() -> None:
    """Against scipy, with resistance and mean gradient retyped."""
    grid = np.linspace(0.0, CURVE.running_time, 400_001)
    at = CURVE.at(grid)
    heights = np.interp(
        at.position[:, None] - np.array([0.0, METRO.length]),
        [-1e3, 500.0, 900.0, 1500.0, 4000.0],
        [0.0, 0.0, 8.0, -7.0, 0.5],
    )
    slope = 1000.0 * (heights[:, 0] - heights[:, 1]) / METRO.length
    v = 3.6 * at.speed
    force = METRO.mass * (
        at.acceleration + 9.81e-3 * (2.031 + 0.0622 * v + 0.001807 * v * v + slope)
    )
    power = np.maximum(force, 0.0) * at.speed
    assert CURVE.energy == pytest.approx(np.trapezoid(power, grid), rel=1e-6)
    assert CURVE.kilowatt_hours == pytest.approx(CURVE.energy / 3.6e6)


def test_a_rear_on_a_low_limit_holds_the_train() -> None:
    """The front's limit rises a train's length behind the track's."""
    course = Course(VARIED, METRO)
    assert course.lowest_limits(np.array([599.0, 717.9, 718.1])).tolist() == [16.0, 16.0, 21.0]
    assert course.lowest_limits(np.array([1259.0, 1261.0])).tolist() == [14.0, 11.0]
    assert course.lowest_limits(np.array([1417.9, 1418.1])).tolist() == [11.0, 22.0]


@pytest.mark.parametrize(
    ("what", "driving", "change"),
    [
        ("speed", Driving(), {"speed_limits": ((0.0, 16.0), (600.0, 20.0))}),
        ("jerk", Driving(jerk=0.49), {}),
        ("deceleration", Driving(deceleration=0.69), {}),
        ("traction", Driving(traction_share=0.94), {}),
        ("final deceleration", Driving(final_deceleration=0.2), {}),
        ("position of the stop", Driving(), {"length": 3000.1}),
    ],
)
def test_the_check_finds_what_is_violated(what: str, driving: Driving, change: dict) -> None:
    assert CURVE.violations(VARIED, METRO) == ()
    found = CURVE.violations(replace(VARIED, **change), METRO, driving)
    assert [v.what for v in found] == [what]
    assert what in str(found[0]) and "beyond" in str(found[0])


def test_knots_that_do_not_fit_together_are_refused() -> None:
    a = np.array([0.0, 1.0])
    good = SpeedCurve(
        time=a, position=a / 6.0, speed=a / 2.0, acceleration=a, regimes=("traction",), energy=0.0
    )
    assert good.jerk.tolist() == [1.0]
    with pytest.raises(ParameterError, match="miss each other"):
        replace(good, speed=a)
    with pytest.raises(ParameterError, match="must rise"):
        replace(good, time=-a)
    with pytest.raises(ParameterError, match="one knot more"):
        replace(good, regimes=("traction", "brake"))


def test_phases_follow_one_another() -> None:
    phases = fast_curve(section(1544.0), METRO).phases()
    assert [p.regime for p in phases] == ["traction", "cruise", "brake"]
    assert phases[0].start == 0.0
    assert [p.end for p in phases[:-1]] == [p.start for p in phases[1:]]


def test_the_course_against_an_integrated_coasting() -> None:
    """What a course calls resistance is what slows a train down: scipy from 20 m/s."""
    curve = fast_curve(section(1544.0), METRO, coast_from=700.0)
    coast = next(p for p in curve.phases() if p.regime == "coast")
    begin, end = curve.at(coast.start + 2.0), curve.at(coast.end)

    def slowed(t: float, y: np.ndarray) -> list[float]:
        v = 3.6 * y[1]
        return [y[1], -9.81e-3 * (2.031 + 0.0622 * v + 0.001807 * v * v)]

    found = solve_ivp(
        slowed, (0.0, float(end.time - begin.time)), [float(begin.position), float(begin.speed)],
        rtol=1e-10, atol=1e-10,
    ).y[:, -1]  # fmt: skip
    assert found == pytest.approx([float(end.position), float(end.speed)], abs=1e-3)
