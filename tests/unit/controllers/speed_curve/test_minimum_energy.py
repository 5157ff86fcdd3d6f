"""The curve of the least energy: known optimal regimes, other curves, and the study's table."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from railcosim.base.errors import ParameterError
from railcosim.controllers.speed_curve import (
    Driving,
    fast_curve,
    minimum_energy_curve,
    timed_curve,
)
from railcosim.models.line import SEVEN_RUNS, beijing_line_5

from .trains import METRO, section, train

FIRST = beijing_line_5().section(*SEVEN_RUNS[0])
# kWh at running times in s: what a prototype of the study found for 1544 m
TABLE = {100.0: 25.1, 105.0: 21.2, 110.0: 18.6, 120.0: 15.0, 135.0: 11.8}


def drag(v: np.ndarray) -> np.ndarray:
    """Return the metro train's resistance in m/s², retyped."""
    return 9.81e-3 * (2.031 + 0.0622 * 3.6 * v + 0.001807 * (3.6 * v) ** 2)


def pull(v: np.ndarray) -> np.ndarray:
    """Return the acceleration by full traction in m/s², retyped."""
    return np.minimum(280e3, 2.8e6 / np.maximum(v, 0.1)) / 240e3 - drag(v)


def optimal_regimes(length: float, time: float, brake: float) -> float:
    """Return the least energy (kWh) on the level without a bound on jerk.

    Pontryagin's principle: full traction to V, cruising, coasting to U, full braking. For each V
    the time gives U; the best V is searched for.
    """
    v = np.linspace(0.0, 80.0 / 3.6, 40_001)
    rising, falling = pull(v), drag(v)

    def summed(integrand: np.ndarray) -> np.ndarray:
        return cumulative_trapezoid(integrand, v, initial=0.0)

    up = summed(v / rising), summed(1.0 / rising)
    coast = summed(v / falling), summed(1.0 / falling)
    work = summed(v * (1.0 + falling / rising))
    best = math.inf
    for k in range(2000, len(v), 20):
        low = np.arange(k + 1)
        way = up[0][k] + coast[0][k] - coast[0][low] + v[low] ** 2 / (2.0 * brake)
        spent = up[1][k] + coast[1][k] - coast[1][low] + v[low] / brake
        cruise = length - way
        total = np.where(cruise >= 0.0, spent + cruise / v[k], np.nan)
        good = np.flatnonzero(np.isfinite(total))
        if len(good) and total[good].min() <= time <= total[good].max():
            u = np.interp(-time, -total[good], low[good])  # the time falls as U rises
            left = np.interp(u, low[good], cruise[good])
            best = min(best, work[k] + left * falling[k])
    return 240e3 * best / 3.6e6


def test_it_is_the_known_optimum_on_the_level() -> None:
    """Within 1 %: the jerk of 4 m/s³ costs it a little, half-second nodes a little more."""
    driving = Driving(jerk=4.0, final_deceleration=0.7, traction_share=1.0)
    for time in (103.0, 115.0):
        found = minimum_energy_curve(section(1544.0), METRO, driving, time=time)
        assert found.kilowatt_hours == pytest.approx(optimal_regimes(1544.0, time, 0.7), rel=0.01)


@pytest.fixture(scope="module")
def table() -> dict[float, float]:
    found = {}
    for time in TABLE:
        curve = minimum_energy_curve(FIRST, METRO, time=time)
        assert curve.violations(FIRST, METRO) == ()
        assert curve.length == pytest.approx(1544.0, abs=1e-9)
        assert abs(curve.speed[-1]) < 1e-9
        assert curve.running_time == pytest.approx(time, abs=1e-5)  # coasting meets it so
        regimes = [p.regime for p in curve.phases()]
        assert regimes.index("traction") < regimes.index("coast") < regimes.index("brake")
        found[time] = curve.kilowatt_hours
    return found


def test_the_studys_table(table: dict[float, float]) -> None:
    for time, energy in TABLE.items():
        assert table[time] == pytest.approx(energy, rel=0.03)


def test_energy_falls_and_is_convex_over_the_time(table: dict[float, float]) -> None:
    slopes = [(table[b] - table[a]) / (b - a) for a, b in pairwise(sorted(table))]
    assert all(slope < 0.0 for slope in slopes)
    assert all(a < b for a, b in pairwise(slopes))


def test_it_takes_no_more_than_cruising_and_coasting(table: dict[float, float]) -> None:
    coasting = timed_curve(FIRST, METRO, time=105.0)
    assert table[105.0] < coasting.kilowatt_hours < 1.02 * table[105.0]


def test_limits_that_fall_and_rise() -> None:
    where = section(
        1200.0,
        gradients=((0.0, 0.0), (300.0, 12.0), (700.0, -10.0)),
        limits=((0.0, 18.0), (450.0, 10.0), (520.0, 22.0)),
    )
    quickest = fast_curve(where, METRO)
    curve = minimum_energy_curve(where, METRO, time=1.06 * quickest.running_time)
    assert curve.violations(where, METRO) == ()
    assert curve.energy < 0.9 * quickest.energy


def test_a_traction_curve_of_the_trains_own() -> None:
    """A weaker engine from 8 m/s on: both curves keep to it."""
    weak = train(traction_curve=((0.0, 280e3), (8.0, 200e3), (30.0, 40e3)))
    quickest = fast_curve(section(1200.0), weak)
    assert quickest.violations(section(1200.0), weak) == ()
    assert quickest.running_time > fast_curve(section(1200.0), METRO).running_time + 2.0
    curve = minimum_energy_curve(section(1200.0), weak, time=1.1 * quickest.running_time)
    assert curve.violations(section(1200.0), weak) == ()


def test_too_little_time_is_refused_with_the_least() -> None:
    with pytest.raises(ParameterError, match=r"Lishuiqiao' takes .* at least 99\.59\d s, not 99"):
        minimum_energy_curve(FIRST, METRO, time=99.0)
    with pytest.raises(ParameterError, match="node must be a positive time"):
        minimum_energy_curve(FIRST, METRO, time=110.0, node=0.0)


def test_the_least_time_itself_is_the_fast_curve() -> None:
    quickest = fast_curve(FIRST, METRO)
    again = minimum_energy_curve(FIRST, METRO, time=quickest.running_time)
    assert again.energy == quickest.energy
    near = minimum_energy_curve(FIRST, METRO, time=quickest.running_time + 0.1)
    assert near.violations(FIRST, METRO) == () and near.energy < quickest.energy
