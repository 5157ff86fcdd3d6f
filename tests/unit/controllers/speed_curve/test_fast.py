"""The fast curve: against closed forms, against a two-pass reference, on random sections."""

import math

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers.speed_curve import Course, Driving, fast_curve, timed_curve
from railcosim.models.line import SEVEN_RUNS, Section, Train, beijing_line_5

from .trains import FRICTIONLESS, METRO, VARIED, section, train

FREE = train(davis=FRICTIONLESS, max_power=1e12, max_speed=100.0, max_traction_force=240e3)
FULL = Driving(jerk=0.5, deceleration=0.7, final_deceleration=0.0, traction_share=1.0)


def test_a_long_section_in_closed_form() -> None:
    """Force 1 m/s², no resistance, 20 m/s: each change of speed takes v/a + a/j, at v/2."""
    curve = fast_curve(section(2000.0, limits=((0.0, 20.0),)), FREE, FULL)
    rising, braking = 20.0 / 1.0 + 1.0 / 0.5, 20.0 / 0.7 + 0.7 / 0.5
    cruise = (2000.0 - 10.0 * (rising + braking)) / 20.0
    # Traction keeps two ten-thousandths below its envelope.
    assert curve.running_time == pytest.approx(rising + cruise + braking, abs=6e-3)
    assert curve.energy == pytest.approx(240e3 * 20.0**2 / 2.0, rel=1e-6)


def test_a_short_section_in_closed_form() -> None:
    """Neither force nor brake is reached: jerk alone, four equal ramps, s = 2 j τ³."""
    curve = fast_curve(section(2.0), FREE, FULL)
    assert curve.running_time == pytest.approx(4.0 * 2.0 ** (1.0 / 3.0), abs=1e-6)


def two_pass(where: Section, what: Train, driving: Driving) -> float:
    """Return the least time without a bound on jerk: forward and backward in v² over the place."""
    course, step = Course(where, what, driving), 0.25
    places = np.arange(0.0, where.length + step / 2.0, step)
    squares = course.lowest_limits(places - 1e-6) ** 2
    squares = np.minimum(squares, course.lowest_limits(places + 1e-6) ** 2)
    squares[0] = squares[-1] = 0.0
    for k in range(len(places) - 1):
        v, s = math.sqrt(squares[k]), float(places[k])
        pull = float(course.traction(v)) - float(course.resistance(v, s))
        squares[k + 1] = min(squares[k + 1], squares[k] + 2.0 * pull * step)
    for k in range(len(places) - 1, 0, -1):
        most = squares[k] + 2.0 * driving.deceleration * step
        squares[k - 1] = min(squares[k - 1], most)
    v = np.sqrt(squares)
    return float((2.0 * step / (v[1:] + v[:-1])).sum())


@pytest.mark.parametrize("where", [VARIED, section(900.0, gradients=((0.0, 30.0),))])
def test_with_much_jerk_it_is_the_quickest_without(where: Section) -> None:
    driving = Driving(jerk=20.0, final_deceleration=0.7)
    curve = fast_curve(where, METRO, driving)
    assert curve.violations(where, METRO, driving) == ()
    assert curve.running_time == pytest.approx(two_pass(where, METRO, driving), abs=0.5)
    assert curve.running_time >= two_pass(where, METRO, driving) - 0.05
    # A bound on jerk costs time, some ½ a/j at each change of regime.
    slower = fast_curve(where, METRO, Driving(jerk=0.5)).running_time
    assert curve.running_time < slower < curve.running_time + 12.0


def test_random_sections_keep_everything_on_a_fine_grid() -> None:
    rng = np.random.default_rng(20)
    for _ in range(12):
        length = float(rng.uniform(300.0, 2500.0))
        limits, gradients = (
            tuple(
                (float(p), float(v))
                for p, v in zip(
                    [0.0, *np.sort(rng.uniform(10.0, length - 5.0, 4))],
                    rng.uniform(*bounds, 5),
                    strict=True,
                )
            )
            for bounds in ((4.0, 25.0), (-35.0, 35.0))
        )
        where = section(length, gradients=gradients, limits=limits)
        driving = Driving(jerk=float(rng.uniform(0.3, 1.0)), traction_share=1.0, deceleration=1.0)
        curve = fast_curve(where, METRO, driving)
        assert curve.violations(where, METRO, driving) == ()
        assert curve.length == length and curve.speed[-1] == 0.0
        assert curve.acceleration[-1] == -0.25


def test_a_gradient_that_traction_cannot_hold_the_limit_on() -> None:
    """Full traction loses speed uphill, and takes it up again, within the envelope."""
    hill = section(2500.0, gradients=((0.0, 0.0), (700.0, 70.0), (1000.0, -5.0)))
    curve = fast_curve(hill, METRO)
    assert curve.violations(hill, METRO) == ()
    top, low = (float(curve.at_position(s).speed) for s in (700.0, 1050.0))
    assert low < top - 1.0 and curve.speed.max() == 80.0 / 3.6


def test_the_seven_runs() -> None:
    for pair in SEVEN_RUNS:
        where = beijing_line_5().section(*pair)
        curve = fast_curve(where, METRO)
        assert curve.violations(where, METRO) == ()
        assert curve.length == where.length


def test_coasting_for_a_given_time() -> None:
    where = beijing_line_5().section(*SEVEN_RUNS[0])
    for time in (101.0, 125.0):
        curve = timed_curve(where, METRO, time=time)
        assert curve.running_time == pytest.approx(time, abs=1e-5)
        assert "coast" in curve.regimes and curve.violations(where, METRO) == ()
    with pytest.raises(ParameterError, match=r"at least 99\.59\d s, not 99 s"):
        timed_curve(where, METRO, time=99.0)


def test_coasting_where_the_second_acceleration_falls_away() -> None:
    """A low limit half way: below some speed there is only one acceleration."""
    where = beijing_line_5().section(*SEVEN_RUNS[2])
    time = 1.2 * fast_curve(where, METRO).running_time
    curve = timed_curve(where, METRO, time=time)
    assert curve.running_time == pytest.approx(time, abs=1e-5)
    assert curve.violations(where, METRO) == ()


def test_what_cannot_be_is_refused_by_name() -> None:
    with pytest.raises(ParameterError, match=r"A–B.*halts at .* m of 2000 m.*‰"):
        fast_curve(section(2000.0, gradients=((0.0, 0.0), (200.0, 140.0))), METRO)
    with pytest.raises(ParameterError, match="under traction the train halts at 0 m"):
        fast_curve(section(2000.0, gradients=((0.0, 140.0),)), METRO)
    with pytest.raises(ParameterError, match=r"0\.005 m are too short.*takes 0\.\d+ m"):
        fast_curve(section(0.005), METRO)
    with pytest.raises(ParameterError, match=r"deceleration 1\.1 m/s² is above the service brake"):
        fast_curve(section(900.0), METRO, Driving(deceleration=1.1))
    with pytest.raises(ParameterError, match="under coast the train halts"):
        fast_curve(section(900.0, gradients=((0.0, 25.0),)), METRO, coast_from=30.0)
    with pytest.raises(ParameterError, match="cruise must be a positive speed"):
        fast_curve(section(900.0), METRO, cruise=0.0)
    closed = section(900.0)
    object.__setattr__(closed, "speed_limits", ((0.0, 10.0), (400.0, 0.0)))
    with pytest.raises(ParameterError, match="limit from 400 m is 0 m/s; no train gets past it"):
        fast_curve(closed, METRO)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"jerk": 0.0}, "jerk must be positive"),
        ({"deceleration": -1.0}, "must not be negative"),
        ({"traction_share": 1.1}, "at most 1"),
        ({"final_deceleration": 0.9}, "must not be above"),
    ],
)
def test_driving_that_cannot_be(change: dict[str, float], says: str) -> None:
    with pytest.raises(ParameterError, match=says):
        Driving(**change)
