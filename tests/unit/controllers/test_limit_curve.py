"""The limit curve against its definition, computed another way: by looking at every place ahead."""

import math
import random
from typing import Any

import casadi as ca
import numpy as np
import pytest

from railcosim import Constant, Diagram
from railcosim.base.errors import ParameterError
from railcosim.controllers.limit_curve import LimitCurve
from railcosim.fmus import trace

LINE = LimitCurve(
    maximum=20.0,
    braking=0.8,
    restrictions=((300.0, 400.0, 10.0), (390.0, 420.0, 7.0), (900.0, 901.0, 12.0)),
    stops=(700.0, 1200.0),
    train_length=50.0,
)


def neighbours(place: float) -> tuple[float, float, float]:
    return math.nextafter(place, -math.inf), place, math.nextafter(place, math.inf)


def edges(curve: LimitCurve) -> list[float]:
    """Return all places where something begins or ends, and one ulp either side."""
    found = [*curve.stops]
    for start, end, _ in curve.restrictions:
        found += [start, end, end + curve.train_length]
    return [s for place in found for s in neighbours(place)]


def random_curve(generator: random.Random) -> LimitCurve:
    restrictions = []
    for _ in range(generator.randrange(4)):
        start = generator.uniform(0.0, 900.0)
        length = generator.choice([0.5, 5.0, 300.0]) * generator.uniform(0.5, 1.5)
        restrictions.append((start, start + length, generator.uniform(1.0, 25.0)))
    stops = sorted(generator.uniform(100.0, 1000.0) for _ in range(generator.randrange(3)))
    return LimitCurve(
        maximum=generator.uniform(8.0, 25.0),
        braking=generator.uniform(0.3, 1.5),
        restrictions=tuple(restrictions),
        stops=tuple(stops),
        train_length=generator.choice([0.0, generator.uniform(1.0, 120.0)]),
    )


def static(curve: LimitCurve, s: float, released: int = 0) -> float:
    """Return the speed that is posted at a place for the train's head, without any braking."""
    speeds = [curve.maximum]
    for start, end, speed in curve.restrictions:
        if start <= s <= end + curve.train_length:  # until the tail has left
            speeds.append(speed)
    if any(s >= stop for stop in curve.stops[released:]):
        speeds.append(0.0)
    return min(speeds)


def by_looking_ahead(curve: LimitCurve, grid: np.ndarray, released: int = 0) -> np.ndarray:
    """Return the fastest speed at each place from which every place ahead can be met by braking."""
    posted = np.array([static(curve, s, released) for s in grid.tolist()])
    found = np.empty_like(posted)
    for i, s in enumerate(grid):
        found[i] = np.sqrt(np.min(posted[i:] ** 2 + 2.0 * curve.braking * (grid[i:] - s)))
    return found


def test_by_hand() -> None:
    at = LINE.speed
    assert at(0.0) == 20.0
    assert at(250.0) == pytest.approx(math.sqrt(100.0 + 1.6 * 50.0))
    assert at(300.0) == at(math.nextafter(300.0, math.inf)) == pytest.approx(10.0)
    assert at(400.0) == at(470.0) == 7.0  # 420 m and 50 m of train: the tail has not left
    assert at(math.nextafter(470.0, math.inf)) == pytest.approx(math.sqrt(1.6 * 230.0))
    assert at(600.0) == pytest.approx(math.sqrt(160.0))
    assert at(700.0) == at(5000.0) == 0.0
    assert at(850.0, 1) == pytest.approx(math.sqrt(144.0 + 1.6 * 50.0))
    assert at(1100.0, 1) == pytest.approx(math.sqrt(160.0))
    assert at(5000.0, 2) == 20.0


def test_flats_are_exact() -> None:
    generator = random.Random(3)
    for _ in range(2000):
        maximum = generator.uniform(0.1, 100.0)
        assert LimitCurve(maximum=maximum, braking=1.0).speed(0.0) == maximum


def test_against_looking_at_every_place_ahead() -> None:
    generator = random.Random(5)
    for _ in range(60):
        curve = random_curve(generator)
        released = generator.randrange(len(curve.stops) + 1)
        grid = np.unique(np.concatenate([np.linspace(-50.0, 1500.0, 700), edges(curve)]))
        found = [curve.speed(s, released) for s in grid.tolist()]
        expected = by_looking_ahead(curve, grid, released)
        # The root turns one ulp of the place into 1e-6 m/s just before a stop.
        assert np.array(found) ** 2 == pytest.approx(expected**2, abs=1e-9)


def highest_on_the_way(
    curve: LimitCurve, s: float, v: float, a: float, time: float, released: int
) -> float:
    """Return the largest v² − v_lim² of full acceleration, at many instants and at all edges."""
    speeds = np.linspace(v, v + a * time, 400)
    ways = (speeds**2 - v * v) / (2.0 * a)
    places = [s + w for w in ways.tolist()]
    places += [e for e in edges(curve) if s <= e <= s + ways[-1]]
    return max(v * v + 2.0 * a * (p - s) - curve.speed(p, released) ** 2 for p in places)


def test_excess_is_the_largest_on_the_way() -> None:
    generator = random.Random(7)
    inside_decides = 0
    for _ in range(2000):
        curve = random_curve(generator)
        released = generator.randrange(len(curve.stops) + 1)
        s, v = generator.uniform(0.0, 1000.0), generator.uniform(0.0, 20.0)
        a, time = generator.uniform(0.1, 2.0), generator.uniform(0.1, 5.0)
        found = curve.excess(s, v, acceleration=a, time=time, released=released)
        expected = highest_on_the_way(curve, s, v, a, time, released)
        assert found == pytest.approx(expected, abs=1e-6)
        end = s + v * time + a * time * time / 2.0
        at_end = (v + a * time) ** 2 - curve.speed(end, released) ** 2
        inside_decides += found > at_end + 1e-3
    assert inside_decides > 10  # a restriction that ends within the time


def test_no_motion_with_less_acceleration_comes_higher() -> None:
    """Motions that brake and accelerate at random, within the same acceleration and time."""
    generator = random.Random(9)
    for _ in range(500):
        curve = random_curve(generator)
        s = start = generator.uniform(0.0, 1000.0)
        v, a, time = generator.uniform(0.0, 20.0), generator.uniform(0.1, 2.0), 4.0
        bound = curve.excess(start, v, acceleration=a, time=time)
        for _ in range(40):
            rate = generator.choice([a, generator.uniform(-3.0, a)])
            following = max(v + rate * time / 40, 0.0)
            s += (v + following) / 2.0 * time / 40
            v = following
            assert v * v - curve.speed(s) ** 2 <= bound + 1e-9


def test_a_speed_below_zero_counts_as_zero() -> None:
    options: Any = {"acceleration": 1.0, "time": 2.0}
    assert LINE.excess(690.0, -0.3, **options) == LINE.excess(690.0, 0.0, **options)


def test_the_next_stop_within_a_distance() -> None:
    assert LINE.before_stop(650.0, 50.0) == LINE.before_stop(700.0, 50.0) == 1.0
    assert LINE.before_stop(math.nextafter(650.0, 0.0), 50.0) == 0.0
    assert LINE.before_stop(math.nextafter(700.0, 1e9), 50.0) == 0.0  # passed
    assert LINE.before_stop(1190.0, 50.0) == 0.0  # the next one is that at 700 m
    assert LINE.before_stop(1190.0, 50.0, 1.0) == 1.0
    assert LINE.before_stop(1190.0, 50.0, 2.0) == 0.0


def test_points_for_plotting_have_upright_edges() -> None:
    places, speeds = LINE.points(0.0, 1300.0, count=11)
    assert {300.0, 470.0, 700.0, 951.0, 1200.0} <= set(places.tolist())
    behind = places.tolist().index(470.0) + 1
    assert places[behind] - 470.0 < 1e-9
    assert speeds[behind] > speeds[behind - 1] == 7.0
    assert speeds.tolist() == [LINE.speed(s) for s in places.tolist()]
    assert LINE.points(0.0, 1300.0, released=2)[1][-1] == 20.0
    with pytest.raises(ParameterError, match="must end behind it"):
        LINE.points(10.0, 10.0)
    with pytest.raises(ParameterError, match="count must be 2 or more"):
        LINE.points(0.0, 10.0, count=1)


def test_traced_is_the_same() -> None:
    traced, generator = trace(LINE), random.Random(13)
    places = edges(LINE) + [generator.uniform(-100.0, 1500.0) for _ in range(10_000)]
    y, _ = traced.map(len(places))(ca.DM(0, len(places)), ca.DM(places).T, ca.DM(0, len(places)))
    expected = [LINE.speed(s) for s in places]
    assert np.array(ca.densify(y)).ravel() == pytest.approx(expected, abs=1e-12)


def test_as_a_block() -> None:
    loop = Diagram("curve", step=1.0)
    loop.add("place", Constant(600.0, unit="m"))
    loop.add("curve", LINE)
    loop.connect("place.y", "curve.position")
    assert loop.run(1.0)["curve.limit"].tolist() == [LINE.speed(600.0)] * 2


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"maximum": 0.0}, "maximum must be a positive number"),
        ({"braking": -1.0}, "braking must be a positive number"),
        ({"train_length": -1.0}, "train_length must be a length from 0 m"),
        ({"restrictions": ((0.0, 10.0),)}, r"a restriction is \(from in m, to in m, m/s\)"),
        ({"restrictions": (5.0,)}, "a restriction is"),
        ({"restrictions": 5.0}, "restrictions must be a list, not 5.0"),
        ({"restrictions": ((10.0, 10.0, 5.0),)}, "from 10 m must end behind it"),
        ({"restrictions": ((0.0, 10.0, 0.0),)}, "place that must not be passed is a stop"),
        ({"restrictions": ((0.0, math.nan, 1.0),)}, "a restriction is"),
        ({"stops": (100.0, 50.0)}, "stops must ascend; 50 m follows 100 m"),
        ({"stops": ("x",)}, "a stop must be a place in m, not 'x'"),
    ],
)
def test_wrong_parameters_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        LimitCurve(**{"maximum": 20.0, "braking": 0.8, **options})


def test_lists_will_do() -> None:
    given: Any = {"restrictions": [[0, 10, 5.0]], "stops": [20.0]}
    made = LimitCurve(maximum=20.0, braking=0.8, **given)
    assert made == LimitCurve(
        maximum=20.0, braking=0.8, restrictions=((0.0, 10.0, 5.0),), stops=(20.0,)
    )
