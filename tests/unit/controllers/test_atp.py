"""ATP: levels, latch, release, pass-through, overlap; its guarantee; traced equal to itself."""

import math
import random
from dataclasses import replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest

from railcosim import Constant, Diagram, Profile, Step
from railcosim.base.errors import ParameterError
from railcosim.controllers.atp import ATP
from railcosim.controllers.limit_curve import LimitCurve
from railcosim.fmus import trace

CURVE = LimitCurve(
    maximum=20.0,
    braking=0.8,
    restrictions=((300.0, 400.0, 10.0), (410.0, 412.0, 7.0)),
    stops=(700.0, 1500.0),
)
PROTECTION = ATP(
    curve=CURVE,
    acceleration=1.0,
    emergency_time=1.45,
    service_time=2.95,
    warning_time=3.95,
    emergency_command=-8.0,
    service_command=-4.0,
)


class Shown(NamedTuple):
    command: float
    emergency: float
    service: float
    warning: float
    limit: float
    margin: float


def shown(x: Any, position: float, speed: float, release: float = 0.0) -> tuple[Shown, Any]:
    outputs, x = PROTECTION.step(x, position, speed, 3.25, release)
    return Shown(*outputs), x


def levels(speed: float, position: float = 0.0) -> tuple[float, float, float]:
    found, _ = shown(PROTECTION.start(), position, speed)
    return found.warning, found.service, found.emergency


def test_thresholds_on_the_flat() -> None:
    """T is the level's time and one period: v + a T is compared with 20 m/s."""
    assert levels(14.9) == (0.0, 0.0, 0.0)
    assert levels(16.1) == (1.0, 0.0, 0.0)
    assert levels(17.1) == (1.0, 1.0, 0.0)
    assert levels(18.4) == (1.0, 1.0, 0.0)
    assert levels(18.6) == (1.0, 1.0, 1.0)


def test_threshold_before_a_stop() -> None:
    """v + a T = v_lim(s + v T + a T²/2), solved for s by hand with T = 1.5 s."""
    v, a, b, time = 10.0, 1.0, 0.8, 1.5
    place = 700.0 - v * time - a * time**2 / 2.0 - (v + a * time) ** 2 / (2.0 * b)
    assert levels(v, place - 1e-9)[2] == 0.0
    assert levels(v, place + 1e-9)[2] == 1.0


def test_the_end_of_a_restriction_within_the_time_counts() -> None:
    """In 4 s from 398 m the train is beyond 412 m, where 20 m/s are allowed again."""
    assert CURVE.speed(398.0 + 7.0 * 4.0 + 8.0) > 11.0
    assert levels(7.0, 398.0)[0] == 1.0
    fast_enough = math.sqrt(7.0**2 - 2.0 * 1.0 * (412.0 - 398.0))
    assert levels(fast_enough - 1e-6, 398.0)[0] == 0.0
    assert levels(fast_enough + 1e-6, 398.0)[0] == 1.0


def test_without_danger_the_demand_passes_bit_for_bit() -> None:
    generator = random.Random(1)
    for _ in range(1000):
        demand = generator.uniform(-1.0, 1.0) * 10.0 ** generator.randrange(-300, 300)
        (command, *_), _ = PROTECTION.step(PROTECTION.start(), 0.0, 5.0, demand, 0.0)
        assert command == demand


def test_a_warning_passes_the_demand() -> None:
    found, _ = shown(PROTECTION.start(), 0.0, 16.1)
    assert (found.command, found.warning, found.service) == (3.25, 1.0, 0.0)


def test_limit_and_margin() -> None:
    found, _ = shown(PROTECTION.start(), 350.0, 8.5)
    assert (found.limit, found.margin) == (CURVE.speed(350.0), CURVE.speed(350.0) - 8.5)


def test_the_service_brake_lasts_until_the_warning_ends() -> None:
    x = PROTECTION.start()
    speeds = [16.5, 17.1, 16.9, 16.1, 15.9, 16.5]
    commands = []
    for speed in speeds:
        found, x = shown(x, 0.0, speed)
        commands.append(found.command)
    assert commands == [3.25, -4.0, -4.0, -4.0, 3.25, 3.25]


def test_the_service_brake_ends_at_standstill_by_release() -> None:
    """Where the train stands there is a warning, for ever, but no call for the service brake."""
    nearer, further = (PROTECTION.least_overlap(level=n) for n in ("service", "warning"))
    place, x = 700.0 - (nearer + further) / 2.0, (0.0, 1.0, 0.0, 1.0)
    found, held = shown(x, place, 0.0, 0.0)
    assert (found.service, found.command, found.warning) == (1.0, -4.0, 1.0)
    found, _ = shown(x, place, 0.0, 1.0)  # it has been up: no stop is released
    assert (found.service, found.command, found.warning) == (0.0, 3.25, 1.0)
    found, _ = shown(held, place, 0.0, 1.0)  # it rises: the stop is
    assert (found.service, found.command, found.warning) == (0.0, 3.25, 0.0)


def test_emergency_is_latched_until_standstill_and_release() -> None:
    _, x = shown(PROTECTION.start(), 0.0, 19.5)
    for speed, release in ((10.0, 0.0), (10.0, 1.0), (0.06, 1.0), (-0.06, 1.0), (0.0, 0.0)):
        found, x = shown(x, 0.0, speed, release)
        assert (found.emergency, found.command) == (1.0, -8.0)
    found, x = shown(x, 0.0, 0.0, 1.0)
    assert (found.emergency, found.command) == (0.0, 3.25)
    found, _ = shown(x, 0.0, 0.0, 0.0)
    assert found.emergency == 0.0


@pytest.mark.parametrize("speed", [0.05, -0.05])
def test_standstill_is_a_small_speed_either_way(speed: float) -> None:
    found, _ = shown((1.0, 0.0, 0.0, 0.0), 0.0, speed, 1.0)
    assert found.emergency == 0.0
    found, _ = shown((1.0, 0.0, 0.0, 0.0), 0.0, speed * (1 + 1e-15), 1.0)
    assert found.emergency == 1.0


def test_no_release_while_the_danger_lasts() -> None:
    beyond = 700.1
    x = (1.0, 0.0, 0.0, 0.0)
    for release in (1.0, 0.0, 1.0):
        found, x = shown(x, beyond, 0.0, release)
        assert (found.emergency, found.limit) == (1.0, 0.0)


def test_emergency_goes_over_service() -> None:
    found, _ = shown(PROTECTION.start(), 0.0, 19.5)
    assert (found.emergency, found.service, found.warning) == (1.0, 1.0, 1.0)
    assert found.command == -8.0


def test_a_stop_is_released_where_the_train_stands_before_it() -> None:
    place = 690.0
    found, x = shown(PROTECTION.start(), place, 0.0, 1.0)
    assert found.limit == CURVE.speed(place)  # release was up from the start
    found, x = shown(x, place, 0.0, 0.0)
    found, x = shown(x, place, 0.0, 1.0)
    assert found.limit == CURVE.speed(place, 1) == 20.0
    for release in (1.0, 0.0, 1.0):  # the next stop is far: nothing more to release
        found, x = shown(x, place, 0.0, release)
        assert found.limit == 20.0
    found, _ = shown(x, 1490.0, 0.0)
    assert found.limit == CURVE.speed(1490.0, 1) == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("place", "speed"), [(690.0, 1.0), (640.0, 0.0), (701.0, 0.0)], ids=["moving", "far", "passed"]
)
def test_no_stop_is_released_from(place: float, speed: float) -> None:
    _, x = shown(PROTECTION.start(), place, speed, 0.0)
    found, x = shown(x, place, speed, 1.0)
    assert found.limit == CURVE.speed(place)
    assert x[2] == 0.0


def test_a_release_that_ends_an_emergency_releases_no_stop() -> None:
    found, x = shown((1.0, 0.0, 0.0, 0.0), 690.0, 0.0, 1.0)
    assert (found.emergency, x[2]) == (0.0, 0.0)


def test_the_release_of_a_stop_ends_a_service_brake_that_holds_for_its_sake() -> None:
    place = 699.0 - PROTECTION.least_overlap(level="emergency")
    found, x = shown(PROTECTION.start(), place, 0.0)
    assert (found.emergency, found.service) == (0.0, 1.0)
    found, _ = shown(x, place, 0.0, 1.0)
    assert (found.service, found.warning, found.command) == (0.0, 0.0, 3.25)


# Overlap


def test_least_overlap_at_standstill() -> None:
    """½ a T² to get going, and (a T)² / 2b to stop again."""
    time = 3.95 + 0.05
    expected = time**2 / 2.0 + time**2 / (2.0 * 0.8)
    assert PROTECTION.least_overlap() == pytest.approx(expected)
    assert levels(0.0, 700.0 - expected - 1e-6)[0] == 0.0
    assert levels(0.0, 700.0 - expected + 1e-6)[0] == 1.0


@pytest.mark.parametrize("stopping", [0.0, 0.1, 0.4, 0.7, 0.8, 1.1])
@pytest.mark.parametrize("level", ["warning", "service", "emergency"])
def test_least_overlap_on_a_stopping_curve(stopping: float, level: Any) -> None:
    """Just enough: with it the level stays off all the way, with 1 mm less it comes up."""
    alone = replace(PROTECTION, curve=replace(CURVE, maximum=20.0, restrictions=(), stops=(700.0,)))
    overlap = alone.least_overlap(stopping, level=level)
    time = alone.look_ahead(level)

    def comes_up(overlap: float) -> bool:
        mark = 700.0 - overlap
        for v in np.linspace(0.0, 20.0, 20_001).tolist() if stopping else [0.0]:
            s = mark - (v * v / (2.0 * stopping) if stopping else 0.0)
            # 20 m/s and more are not allowed on the flat itself: the stop alone is looked at.
            reach = v * time + time * time / 2.0
            if (v + time) ** 2 > 1.6 * (700.0 - s - reach):
                return True
        return False

    assert not comes_up(overlap + 1e-6)
    assert comes_up(overlap - 1e-3)


def test_the_closed_form_of_the_overlap() -> None:
    a, b, c, time = 1.0, 0.8, 0.4, 4.0
    expected = time**2 * (a + b) * (a + c) / (2.0 * (b - c))
    wide = replace(PROTECTION, curve=replace(CURVE, maximum=100.0))
    assert wide.least_overlap(c) == pytest.approx(expected)


# The guarantee, with trains that are just as bad as the braking model allows


def ridden(
    atp: ATP,
    generator: random.Random,
    *,
    lateness: float = 0.0,
    flat_out: bool = False,
    release: float = 0.0,
) -> float:
    """Return the least v_lim² − v² of one run, at many instants between the samples as well.

    The train accelerates as it likes up to atp.acceleration until the emergency brake acts,
    emergency_time (+ lateness, s) after the sample that called for it, then brakes just as much as
    guaranteed. Constant accelerations: the motion is exact.
    """
    s = v = t = 0.0
    x, acts, least = atp.start(), math.inf, math.inf
    pieces = 8
    h = atp.period / pieces
    while t < 120.0 and (release or t < acts or v > 0.0):
        (_, emergency, *_), x = atp.step(x, s, v, 1.0, release)
        if not emergency:
            acts = math.inf
        elif acts == math.inf:
            acts = t + atp.emergency_time + lateness
        lazy = generator.uniform(-0.5, 1.0)
        rate = atp.acceleration if flat_out else min(atp.acceleration, lazy * 2.0)
        for _ in range(pieces):
            for piece in _cut(t, t + h, acts):
                a = rate if t < acts else -atp.curve.braking
                following = max(v + a * piece, 0.0)
                rolled = (
                    piece if following > 0.0 or a == 0.0 else min(piece, -v / a if a else piece)
                )
                s += (v + following) / 2.0 * rolled
                v, t = following, t + piece
                least = min(least, atp.curve.speed(s) ** 2 - v * v)
    return least


def _cut(begin: float, end: float, at: float) -> list[float]:
    return [at - begin, end - at] if begin < at < end else [end - begin]


def random_protection(generator: random.Random) -> ATP:
    places = sorted(generator.uniform(150.0, 1200.0) for _ in range(3))
    lengths = [generator.choice([0.5, 5.0, 100.0]) for _ in places]
    curve = LimitCurve(
        maximum=generator.uniform(10.0, 25.0),
        braking=generator.uniform(0.4, 1.3),
        restrictions=tuple(
            (p, p + n, generator.uniform(5.0, 12.0))
            for p, n in zip(places[:2], lengths[:2], strict=True)
        ),
        stops=(places[2] + 150.0,),
        train_length=generator.choice([0.0, 40.0]),
    )
    time = generator.uniform(0.3, 2.0)
    return ATP(
        curve=curve,
        acceleration=generator.uniform(0.3, 1.3),
        emergency_time=time,
        service_time=time + 0.5,
        warning_time=time + 1.0,
        period=generator.choice([0.02, 0.1, 0.5]),
    )


@pytest.mark.parametrize("flat_out", [True, False], ids=["flat_out", "at_random"])
def test_the_guarantee(flat_out: bool) -> None:
    """The curve is never passed, and full traction uses it up: no more is kept than a period."""
    generator = random.Random(23)
    found = [ridden(random_protection(generator), generator, flat_out=flat_out) for _ in range(120)]
    assert min(found) >= -1e-9
    if flat_out:
        assert min(found) < 0.5  # (m/s)²


def test_the_guarantee_goes_on_after_each_release() -> None:
    """With the release held the train goes from one emergency stop to the next, up to the stop."""
    generator = random.Random(29)
    for _ in range(20):
        atp = random_protection(generator)
        assert ridden(atp, generator, flat_out=True, release=1.0) >= -1e-9


def test_a_brake_later_than_its_time_passes_the_curve() -> None:
    """Two periods late: one is kept for the sampling, so that this is at least one too many."""
    generator = random.Random(23)
    for _ in range(20):
        atp = random_protection(generator)
        assert ridden(atp, generator, lateness=2.0 * atp.period, flat_out=True) < 0.0


# Traced


def largest_difference(block: ATP, states: list[Any], inputs: list[tuple[float, ...]]) -> float:
    """Return the largest difference of outputs and next states, and require equal modes."""
    y, following = trace(block).map(len(states))(
        ca.DM(np.array(states).T), ca.DM(np.array(inputs).T), ca.DM(0, len(states))
    )
    found = np.vstack([np.array(ca.densify(y)), np.array(ca.densify(following))]).T
    expected = np.array(
        [
            [*outputs, *x]
            for outputs, x in (block.step(s, *u) for s, u in zip(states, inputs, strict=True))
        ]
    )
    assert np.array_equal(found[:, [1, 2, 3, 6, 7, 8, 9]], expected[:, [1, 2, 3, 6, 7, 8, 9]])
    return float(np.max(np.abs(found - expected)))


def random_state(generator: random.Random) -> tuple[float, ...]:
    flags = [float(generator.random() < 0.5) for _ in range(3)]
    return flags[0], flags[1], float(generator.randrange(3)), flags[2]


def test_traced_at_random_points() -> None:
    generator = random.Random(31)
    states, inputs = [], []
    for _ in range(10_000):
        states.append(random_state(generator))
        speed = generator.choice([generator.uniform(-0.1, 0.1), generator.uniform(0.0, 22.0)])
        place, demand = generator.uniform(0.0, 1600.0), generator.uniform(-10.0, 10.0)
        inputs.append((place, speed, demand, float(generator.random() < 0.5)))
    assert largest_difference(PROTECTION, states, inputs) <= 1e-12


def around(value: float) -> tuple[float, float, float]:
    return math.nextafter(value, -math.inf), value, math.nextafter(value, math.inf)


def thresholds(level: Any, place: float) -> tuple[float, ...]:
    """Return the speeds around the one where a level comes up, found by halving to the last ulp."""
    low, high = 0.0, 30.0
    while math.nextafter(low, math.inf) < high:
        middle = (low + high) / 2.0
        time = PROTECTION.look_ahead(level)
        above = CURVE.excess(place, middle, acceleration=1.0, time=time) > 0.0
        low, high = (low, middle) if above else (middle, high)
    return (*around(low), *around(high))


def test_traced_on_the_edges() -> None:
    """Every edge of a restriction, stop and window, and the threshold speeds there, ± 1 ulp."""
    edges = [300.0, 400.0, 410.0, 412.0, 650.0, 700.0, 1450.0, 1500.0]
    edges += [
        700.0 - PROTECTION.least_overlap(level=n) for n in ("warning", "service", "emergency")
    ]
    generator = random.Random(37)
    states, inputs = [], []
    for edge in edges:
        for place in around(edge):
            speeds = [s for n in ("warning", "service", "emergency") for s in thresholds(n, place)]
            for speed in (*speeds, *around(0.05), *around(-0.05), *around(0.0)):
                for release in around(0.5):
                    states.append(random_state(generator))
                    inputs.append((place, speed, 1.5, release))
    assert largest_difference(PROTECTION, states, inputs) <= 1e-12


def test_a_parameter_can_be_a_symbol() -> None:
    names = ["acceleration", "emergency_time", "period", "standstill_speed"]
    traced = trace(PROTECTION, parameters=names)
    y, _ = traced(PROTECTION.start(), [0.0, 17.0, 1.0, 0.0], [1.4, 2.4, 0.1, 0.0])
    other = replace(
        PROTECTION, acceleration=1.4, emergency_time=2.4, period=0.1, standstill_speed=0.0
    )
    expected, _ = other.step(other.start(), 0.0, 17.0, 1.0, 0.0)
    assert expected[1] == 1.0
    assert tuple(np.array(ca.densify(y)).ravel()) == expected


# In a diagram


def test_in_a_diagram_the_command_has_the_demands_unit() -> None:
    loop = Diagram("override", step=0.05)
    loop.add("place", Constant(0.0, unit="m"))
    loop.add("speed", Profile(((0.0, 10.0), (1.0, 20.0), (2.0, 0.0)), unit="m/s"))
    loop.add("demand", Constant(9.0, unit="N"))
    loop.add("release", Step(at=3.0, to=1.0))
    loop.add("atp", PROTECTION)
    for name in ("position", "speed", "demand", "release"):
        source = {"position": "place"}.get(name, name)
        loop.connect(f"{source}.y", f"atp.{name}")
    run = loop.run(4.0)
    assert run.units["atp.command"] == "N"
    assert {9.0, -4.0, -8.0} == set(run["atp.command"].tolist())
    emergency = run["atp.emergency"]
    assert emergency[run.time < 0.85].max() == 0.0
    assert emergency[(run.time > 0.9) & (run.time < 3.0)].min() == 1.0
    assert emergency[run.time >= 3.0].max() == 0.0


def test_a_parameter_of_the_curve_can_be_set() -> None:
    changed = PROTECTION.with_parameter("curve.braking", 0.6)
    assert changed.curve.braking == 0.6
    assert "curve.maximum" in PROTECTION.parameters()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"curve": 20.0}, "curve must be a LimitCurve, not 20.0"),
        ({"acceleration": -1.0}, "acceleration must not be negative, is -1.0"),
        ({"emergency_time": -0.1}, "emergency_time must not be negative"),
        ({"service_time": 1.45}, r"service_time must be longer than emergency_time \(1.45 s\)"),
        ({"warning_time": 2.0}, r"warning_time must be longer than service_time \(2.95 s\)"),
        ({"emergency_command": math.nan}, "emergency_command must be a finite number"),
        ({"standstill_speed": -0.1}, "standstill_speed must not be negative"),
        ({"release_within": math.inf}, "release_within must be a finite number"),
        ({"period": 0.0}, "period must be a positive number"),
    ],
)
def test_wrong_parameters_are_refused(options: Any, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        replace(PROTECTION, **options)


def test_wrong_questions_are_refused() -> None:
    with pytest.raises(ParameterError, match="no level 'brake'; warning, service, emergency"):
        PROTECTION.look_ahead("brake")  # pyright: ignore
    with pytest.raises(ParameterError, match="stopping must not be negative"):
        PROTECTION.least_overlap(-0.1)
