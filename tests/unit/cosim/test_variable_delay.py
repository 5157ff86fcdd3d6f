"""The variable delay, driven by hand: what it keeps, what it refuses, and its definitions."""

import copy
import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.cosim.blocks.delay_buffer import CHUNK
from railcosim.cosim.blocks.variable_delay import VariableDelay

KINDS = ["time", "transport"]


def tick(block: VariableDelay, x: Any, t: float, u: float, delay: float) -> tuple[float, Any]:
    """One sample hit, in whichever of its two forms the block declares."""
    if block.feedthrough:
        assert block.direct == ()
        return block.step(x, t, u, delay)
    assert block.direct == ("delay",)
    return block.output(x, t, delay), block.update(x, t, u, delay)


def drive(
    block: VariableDelay,
    times: Sequence[float],
    u: Callable[[float], float],
    delay: Callable[[float], float],
) -> np.ndarray:
    x, values = block.start(), []
    for t in times:
        y, x = tick(block, x, t, u(t), delay(t))
        values.append(y)
    return np.array(values)


def grid(step: float, stop: float) -> list[float]:
    per_second = round(1.0 / step)
    return [k / per_second for k in range(round(stop * per_second) + 1)]


def wave(t: float) -> float:
    return math.sin(2.0 * t) + 0.3 * math.cos(7.0 * t)


def size(x: Any) -> int:
    return sum(len(chunk) for chunk in x[2]) + len(x[3])


# The definition y(t) = u(t − τ(t))


def test_a_ramp_is_exact_under_a_delay_that_grows_like_one() -> None:
    times = grid(0.1, 5.0)
    block = VariableDelay(maximum=2.0, initial=-7.0)
    y = drive(block, times, lambda t: 2.0 + 3.0 * t, lambda t: 0.55 + 0.2 * t)
    read = [t - (0.55 + 0.2 * t) for t in times]
    expected = [-7.0 if s < 0.0 else 2.0 + 3.0 * s for s in read]
    assert y == pytest.approx(expected, abs=1e-13)


def test_a_sine_keeps_to_the_bound_of_linear_interpolation() -> None:
    """|error| ≤ h² ω² / 8, and of order two, under a delay that swings."""
    worst = []
    for step in (0.02, 0.01, 0.005):
        times = grid(step, 6.0)
        read = np.array([t - (1.0 + 0.5 * math.sin(1.3 * t)) for t in times])
        y = drive(
            VariableDelay(maximum=1.5),
            times,
            lambda t: math.sin(5.0 * t),
            lambda t: 1.0 + 0.5 * math.sin(1.3 * t),
        )
        worst.append(float(np.max(np.abs(y - np.sin(5.0 * read))[read >= 0.0])))
        assert worst[-1] <= step**2 * 25.0 / 8.0
    assert np.log2(np.array(worst[:-1]) / worst[1:]) == pytest.approx(2.0, abs=0.1)


def test_a_growing_delay_lowers_the_pitch() -> None:
    """τ = τ0 + a t: y is a sine of ω (1 − a), as behind a source that moves away."""
    times = grid(0.001, 3.0)
    block = VariableDelay(maximum=1.0)
    y = drive(block, times, lambda t: math.sin(10.0 * t), lambda t: 0.1 + 0.25 * t)
    expected = [math.sin(7.5 * t - 1.0) if 0.75 * t >= 0.1 else 0.0 for t in times]
    assert y == pytest.approx(expected, abs=1.3e-5)


def test_a_delay_that_grows_faster_than_time_reads_backwards() -> None:
    times = grid(0.1, 2.0)
    block = VariableDelay(maximum=4.0, initial=9.0)
    y = drive(block, times, lambda t: t, lambda t: 0.0 if t < 1.0 else 2.0 * (t - 1.0))
    expected = [t if t < 1.0 else t - 2.0 * (t - 1.0) for t in times]
    assert y == pytest.approx(expected, abs=1e-14)
    assert np.all(np.diff(y)[10:] < 0.0)


def test_a_delay_that_falls_faster_than_time_skips_ahead() -> None:
    times = grid(0.1, 2.0)
    y = drive(VariableDelay(maximum=2.0), times, lambda t: t, lambda t: max(1.0, 2.0 - 3.0 * t) - 1)
    assert y == pytest.approx([max(t - max(0.0, 1.0 - 3.0 * t), 0.0) for t in times], abs=1e-14)


def test_half_a_step_lies_between_the_last_sample_and_the_present() -> None:
    """At t = 5 with a step of 1 and a delay of 0.5: half way, where Simulink extrapolates."""
    y = drive(
        VariableDelay(maximum=1.0), [float(k) for k in range(6)], lambda t: t * t, lambda t: 0.5
    )
    assert y[5] == 0.5 * (16.0 + 25.0)


def test_no_delay_is_no_delay() -> None:
    times = grid(0.1, 2.0)
    for interpolation in ("linear", "hold"):
        block = VariableDelay(maximum=1.0, initial=9.0, interpolation=interpolation)
        assert drive(block, times, wave, lambda t: 0.0).tolist() == [wave(t) for t in times]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("interpolation", ["linear", "hold"])
@pytest.mark.parametrize("begin", [0.0, 12345.6])
@pytest.mark.parametrize("steps", [3, 97])
def test_an_edge_exactly_at_the_delay_belongs_to_the_new_value(
    kind: Any, interpolation: Any, begin: float, steps: int
) -> None:
    """0.3 s is three steps of 0.1 s, however t − 0.3 is rounded."""
    block = VariableDelay(maximum=10.0, kind=kind, interpolation=interpolation, initial=-1.0)
    start = round(begin * 10)
    times = [(start + k) / 10 for k in range(3000)]
    y = drive(block, times, lambda t: round(t * 10) - start, lambda t: steps / 10)
    assert y.tolist() == [-1.0] * steps + list(range(3000 - steps))


@pytest.mark.parametrize("kind", KINDS)
def test_a_jump_between_history_and_signal_is_not_smeared(kind: Any) -> None:
    block = VariableDelay(maximum=1.0, kind=kind, initial=-1.0)
    y = drive(block, grid(0.1, 0.4), lambda t: 1.0, lambda t: 0.25)
    assert y.tolist() == [-1.0, -1.0, -1.0, 1.0, 1.0]


def test_history_as_a_function() -> None:
    times = grid(0.1, 3.0)
    block = VariableDelay(maximum=2.0, initial=lambda t: t)
    y = drive(block, times, lambda t: t, lambda t: 2.0 - 0.5 * t)
    assert y == pytest.approx([t - (2.0 - 0.5 * t) for t in times], abs=1e-14)


# The definition ∫ ds/τ = 1


def test_a_pipe_with_a_speed_that_changes_steadily_is_exact() -> None:
    """v = 1 + 0.4 t over 2 m: the place entered t_in + 0.2 t_in² = t + 0.2 t² − 2."""
    times = grid(0.1, 6.0)
    block = VariableDelay(maximum=2.0, kind="transport", initial=lambda t: 5.0 * t)
    y = drive(block, times, lambda t: 5.0 * t, lambda t: 2.0 / (1.0 + 0.4 * t))
    travelled = np.array([t + 0.2 * t * t - 2.0 for t in times])
    # Before the start the speed was 1 m/s.
    entered = np.where(
        travelled < 0.0, travelled, (np.sqrt(1.0 + 0.8 * np.abs(travelled)) - 1) / 0.4
    )
    assert y == pytest.approx(5.0 * entered, abs=2e-14)


def order(delay: Callable[[float], float], entered: Callable[[float], float]) -> np.ndarray:
    """Return the orders of the error of y(t) = sin(3 t_in) over halved steps."""
    worst = []
    for step in (0.02, 0.01, 0.005, 0.0025):
        times = grid(step, 5.0)
        block = VariableDelay(maximum=5.0, kind="transport")
        y = drive(block, times, lambda t: math.sin(3.0 * t), delay)
        truth = np.array([math.sin(3.0 * s) if (s := entered(t)) >= 0.0 else 0.0 for t in times])
        worst.append(float(np.max(np.abs(y - truth))))
    assert worst[-1] < 2e-5
    return np.log2(np.array(worst[:-1]) / worst[1:])


def test_a_transit_time_that_grows_steadily() -> None:
    """τ = 0.7 + a t: ln(τ(t) / τ(t_in)) = a."""
    a = 0.4
    orders = order(lambda t: 0.7 + a * t, lambda t: ((0.7 + a * t) * math.exp(-a) - 0.7) / a)
    assert orders == pytest.approx(2.0, abs=0.1)


def test_a_speed_that_swings() -> None:
    """v = 1 + 0.8 sin(3 t) over 1 m: V(t_in) = V(t) − 1 with V the integral."""
    from scipy.optimize import brentq

    def path(t: float) -> float:
        return t + 0.8 * (1.0 - math.cos(3.0 * t)) / 3.0

    def entered(t: float) -> float:
        return float(brentq(lambda s: path(s) - path(t) + 1.0, t - 10.0, t, xtol=1e-14))  # pyright: ignore[reportArgumentType]

    orders = order(lambda t: 1.0 / (1.0 + 0.8 * math.sin(3.0 * t)), entered)
    assert orders == pytest.approx(2.0, abs=0.1)


def test_what_goes_in_comes_out() -> None:
    """What left by 5 s, ∫ y v dt, is the 2 m inside at first and what had entered by t_in(5 s)."""
    from scipy.integrate import quad
    from scipy.optimize import brentq

    def u(t: float) -> float:
        return 2.0 + math.sin(3.0 * t)

    def v(t: float) -> float:
        return 1.0 + 0.7 * math.sin(2.0 * t)

    def path(t: float) -> float:
        return t + 0.35 * (1.0 - math.cos(2.0 * t))

    entry = brentq(lambda s: path(s) - path(5.0) + 2.0, 0.0, 5.0, xtol=1e-14)
    went_in = quad(u, -2.0, 0.0)[0] + quad(lambda s: u(s) * v(s), 0.0, entry, epsabs=1e-12)[0]
    losses = []
    for step in (0.02, 0.01, 0.005, 0.0025):
        times = grid(step, 5.0)
        block = VariableDelay(maximum=5.0, kind="transport", initial=u)
        y = drive(block, times, u, lambda t: 2.0 / v(t))
        came_out = np.trapezoid(y * [v(t) for t in times], times)
        losses.append(abs(float(came_out) - went_in))
    assert losses[-1] < 1e-6 * went_in
    assert np.log2(np.array(losses[:-1]) / losses[1:]) == pytest.approx(2.0, abs=0.2)


def test_a_flow_that_stops_keeps_what_is_inside() -> None:
    """1 m/s, braked to rest from 4 s to 5 s, started again from 8 s to 9 s, over 2 m."""

    def speed(t: float) -> float:
        return max(min(1.0, 5.0 - t), min(1.0, t - 8.0), 1e-13)

    times = grid(0.1, 13.0)
    block = VariableDelay(maximum=6.5, kind="transport")
    y = drive(block, times, lambda t: t, lambda t: 2.0 / speed(t))
    at = dict(zip(times, y, strict=True))
    assert at[4.0] == pytest.approx(2.0, abs=1e-13)
    # By 5 s the flow has moved half a metre more; it rests until 8 s.
    for t in (5.0, 6.0, 7.9):
        assert at[t] == pytest.approx(2.5, abs=1e-12)
    assert at[9.0] == pytest.approx(3.0, abs=1e-12)
    # 11 s: path 4 + 0.5 + 0.5 + 2 = 7, entered at path 5, which is 9 s.
    assert at[11.0] == pytest.approx(9.0, abs=1e-6)
    assert at[13.0] == pytest.approx(11.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_held_speeds_against_whole_numbers(seed: int) -> None:
    """Speeds of whole m/s, held over steps of 0.1 s: exact sums tell which sample leaves."""
    rng = np.random.default_rng(seed)
    speeds = rng.integers(1, 8, 2000).tolist()
    length = 5
    path = [0, *np.cumsum(speeds).tolist()]  # in units of 0.1 m
    expected: list[float] = []
    for k in range(2000):
        place = path[k] - 10 * length
        expected.append(
            float(np.searchsorted(path, place, side="right") - 1) if place >= 0 else -1.0
        )
    block = VariableDelay(maximum=6.0, kind="transport", interpolation="hold", initial=-1.0)
    x, found = block.start(), []
    for k, speed in enumerate(speeds):
        y, x = block.step(x, k / 10, float(k), length / speed)
        found.append(y)
    assert found == expected


@pytest.mark.parametrize("seed", range(3))
def test_held_speeds_within_a_step(seed: int) -> None:
    """The history shows t_in itself: t0 − τ(t0) (1 − renewals), to the last digits."""
    rng = np.random.default_rng(seed)
    delays = rng.uniform(0.5, 3.0, 40).tolist()
    block = VariableDelay(maximum=9.0, kind="transport", interpolation="hold", initial=lambda t: t)
    x, renewed = block.start(), Fraction(0)
    for k, delay in enumerate(delays):
        y, x = block.step(x, k / 64, 0.0, delay)
        expected = -Fraction(delays[0]) * (1 - renewed)
        assert y == pytest.approx(float(expected), abs=1e-15)
        renewed += Fraction(1, 64) / Fraction(delay)


@pytest.mark.parametrize("seed", range(3))
def test_speeds_as_straight_lines_against_bisection(seed: int) -> None:
    """The entry time by bisection in exact arithmetic, of random speeds on a grid of 1/32 s."""
    rng = np.random.default_rng(seed)
    h, delays = Fraction(1, 32), (1.0 / rng.uniform(0.2, 3.0, 150)).tolist()
    v = [1 / Fraction(delay) for delay in delays]
    path = [Fraction(0)]
    for a, b in pairwise(v):
        path.append(path[-1] + h * (a + b) / 2)
    block = VariableDelay(maximum=5.0, kind="transport", initial=lambda t: t)
    x = block.start()
    for k, delay in enumerate(delays):
        y, x = block.step(x, k / 32, k / 32, delay)
        place = path[k] - 1
        if place < 0:
            assert y == pytest.approx(float(place / v[0]), abs=1e-14)
            continue
        j = bisect_right(path, place) - 1
        low, high = Fraction(0), h
        for _ in range(55):
            s = (low + high) / 2
            behind = path[j] + v[j] * s + (v[j + 1] - v[j]) * s * s / (2 * h) <= place
            low, high = (s, high) if behind else (low, s)
        assert y == pytest.approx(float(j * h + low), abs=1e-14)


def test_a_transit_of_less_than_a_step() -> None:
    """Several renewals within one step; a ramp stays exact."""
    times = grid(0.1, 3.0)
    block = VariableDelay(maximum=1.0, kind="transport", initial=lambda t: t)
    y = drive(block, times, lambda t: t, lambda t: 0.013)
    assert y == pytest.approx([t - 0.013 for t in times], abs=1e-14)


@pytest.mark.parametrize("steps", [7001, 9973])
def test_rounding_does_not_gather_over_a_pipe_of_many_samples(steps: int) -> None:
    """Thousands of parts of a renewal, none of them exact, add up to whole ones."""
    block = VariableDelay(maximum=10.0, kind="transport", interpolation="hold", initial=-1.0)
    y = drive(block, grid(0.001, 30.0), lambda t: round(t * 1000), lambda t: steps / 1000)
    assert y.tolist() == [-1.0] * steps + list(range(30_001 - steps))


def test_rounding_does_not_gather_over_a_long_run() -> None:
    """A third of a second at 1 kHz is 333.33 steps; after 300 s the ramp is still exact."""
    block = VariableDelay(maximum=0.4, kind="transport")
    y = drive(block, grid(0.001, 300.0), lambda t: t, lambda t: 1.0 / 3.0)
    assert y[-1] == pytest.approx(300.0 - 1.0 / 3.0, abs=1e-13)


@pytest.mark.parametrize("interpolation", ["linear", "hold"])
def test_a_flow_never_runs_back_by_rounding(interpolation: Any) -> None:
    """Standing still at any moment, and whole renewals in one step, keep the samples in order."""
    rng = np.random.default_rng(5)
    block = VariableDelay(maximum=1e3, kind="transport", interpolation=interpolation)
    x, places = block.start(), []
    for k in range(20_000):
        delay = [0.3, 0.007, 1e300][rng.integers(3)]
        x = block.update(x, k / 100, 0.0, delay)
        places.append(x[3][-1][:2])
    assert places == sorted(places)
    assert all(0.0 <= f < 1.0 for _, f in places)


# Bounds, forms, state


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("steps", [1, 10, 63, 64, 65, 1000])
def test_the_buffer_stays_within_its_bound_and_holds_enough(kind: Any, steps: int) -> None:
    block = VariableDelay(maximum=steps / 1000, kind=kind, initial=-1.0)
    x, most = block.start(), 0
    for k in range(2500):
        y, x = block.step(x, k / 1000, float(k), steps / 1000)
        assert y == (k - steps if k >= steps else -1.0)
        most = max(most, size(x))
    assert most <= steps + 1 + 2 * CHUNK


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("interpolation", ["linear", "hold"])
def test_both_forms_agree_from_one_step_on(kind: Any, interpolation: Any) -> None:
    """Declaring the smallest delay changes when the block is called, not what it gives."""
    times = grid(0.01, 4.0)

    def delay(t: float) -> float:
        return 0.4 + 0.39 * math.cos(9.0 * t)

    both = [
        drive(
            VariableDelay(
                maximum=1.0,
                smallest=smallest,
                kind=kind,
                interpolation=interpolation,
                initial=math.cos,
            ),
            times,
            wave,
            delay,
        )
        for smallest in (0.0, 0.01)
    ]
    assert both[0].tolist() == both[1].tolist()


def test_hold_never_needs_the_present_sample() -> None:
    block = VariableDelay(maximum=1.0, smallest=0.001, interpolation="hold", initial=-1.0)
    y = drive(block, grid(0.1, 0.3), lambda t: 10.0 * t, lambda t: 0.02)
    assert y == pytest.approx([-1.0, 0.0, 1.0, 2.0])


@pytest.mark.parametrize("kind", KINDS)
def test_an_old_state_goes_on_as_it_did(kind: Any) -> None:
    """Rollback and checkpoint: a state kept by reference is not touched by what follows."""

    def delay(t: float) -> float:
        return 0.5 + 0.4 * math.sin(3.0 * t)

    block = VariableDelay(maximum=0.95, kind=kind)
    x, states = block.start(), []
    times = grid(0.001, 3.0)
    for t in times:
        states.append(x)
        _, x = block.step(x, t, wave(t), delay(t))
    for k in (0, 1, 63, 64, 65, 128, 1500):
        kept, before = states[k], copy.deepcopy(states[k])
        runs = []
        for _ in range(2):
            x, values = kept, []
            for t in times[k : k + 700]:
                y, x = block.step(x, t, wave(t), delay(t))
                values.append(y)
            runs.append(values)
        assert runs[0] == runs[1]
        assert kept == before
    # Another future from the same state leaves the first one alone.
    end = states[-1]
    block.step(states[1500], 1.5, 1e6, 0.01)
    assert end == states[-1]


@pytest.mark.parametrize("kind", KINDS)
def test_the_state_is_nested_tuples_of_numbers(kind: Any) -> None:
    def check(part: Any) -> None:
        if isinstance(part, tuple):
            for inner in part:
                check(inner)
        else:
            assert type(part) in (int, float)

    block = VariableDelay(maximum=0.5, kind=kind)
    x = block.start()
    for t in grid(0.001, 1.0):
        if round(t * 1000) % 100 == 0:
            check(x)
        _, x = block.step(x, t, wave(t), 0.3)
    check(x)


def test_a_step_shares_all_but_the_tail() -> None:
    """What a step makes anew does not grow with the buffer."""
    block = VariableDelay(maximum=20.0)
    x = block.start()
    for k in range(20_000):
        _, x = block.step(x, k / 1000, 0.0, 15.0)
    _, following = block.step(x, 20.0, 0.0, 15.0)
    assert len(x[2]) > 250
    assert following[2] is x[2] or all(a is b for a, b in zip(x[2], following[2], strict=False))
    assert len(following[3]) <= CHUNK


# Refusals


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"maximum": 0.0}, "maximum must be a positive number"),
        ({"maximum": math.inf}, "maximum must be a positive number"),
        ({"maximum": 1.0, "smallest": 2.0}, "smallest must lie from 0 to maximum, not 2.0"),
        ({"maximum": 1.0, "smallest": -1.0}, "smallest must lie from 0"),
        ({"maximum": 1.0, "kind": "pipe"}, "kind is 'time' or 'transport', not 'pipe'"),
        ({"maximum": 1.0, "initial": math.nan}, "initial must be a number or a function"),
        ({"maximum": 1.0, "interpolation": "cubic"}, "interpolation is 'linear' or 'hold'"),
    ],
)
def test_parameters_are_checked(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=f"VariableDelay: {words}"):
        VariableDelay(**arguments)


@pytest.mark.parametrize("smallest", [0.0, 0.1])
@pytest.mark.parametrize("delay", [-0.1, math.nan, math.inf, -math.inf, 1.001, 100.0])
def test_a_time_outside_its_bounds_is_refused_at_once(smallest: float, delay: float) -> None:
    block = VariableDelay(maximum=1.0, smallest=smallest)
    words = f"delay = {delay:g} s must lie from smallest = {smallest:g} s to maximum = 1 s"
    with pytest.raises(ValueError, match=words):
        drive(block, grid(0.1, 0.5), wave, lambda t: delay)
    with pytest.raises(ValueError, match=words):
        drive(block, grid(0.1, 0.5), wave, lambda t: delay if t == 0.4 else 0.5)


@pytest.mark.parametrize("delay", [-0.1, 0.0, math.nan, math.inf, 1e-320])
def test_a_pipe_without_transit_time_is_refused(delay: float) -> None:
    block = VariableDelay(maximum=1.0, kind="transport")
    with pytest.raises(ValueError, match=f"delay = {delay:g} s must be positive"):
        drive(block, grid(0.1, 0.5), wave, lambda t: delay if t == 0.4 else 0.5)


@pytest.mark.parametrize("step", [0.1, 0.001])
def test_what_stays_inside_for_too_long_is_refused(step: float) -> None:
    """A transit of 0.4 s until the flow stops at 1 s: 1 s after it entered, at 1.6 s, it is too
    late for what the exit shows then; half a step more flows out while the speed falls.
    """
    block = VariableDelay(maximum=1.0, kind="transport")
    x, last = block.start(), 0.0
    with pytest.raises(ValueError, match="has been inside for more than maximum = 1 s"):
        for t in grid(step, 3.0):
            last = t
            _, x = block.step(x, t, t, 0.4 if t < 1.0 else 1e9)
    assert 1.6 - step <= last <= 1.6 + step


def test_what_has_not_come_through_since_the_start_counts_too() -> None:
    """Standing from the start: the history is shown for `maximum` s, then it is an error."""
    block = VariableDelay(maximum=1.0, kind="transport", initial=4.0)
    assert set(drive(block, grid(0.1, 1.0), wave, lambda t: 1e6).tolist()) == {4.0}
    with pytest.raises(ValueError, match="more than maximum = 1 s"):
        drive(block, grid(0.1, 1.1), wave, lambda t: 1e6)


def test_a_pipe_that_is_passed_too_fast_is_refused() -> None:
    block = VariableDelay(maximum=1.0, smallest=0.2, kind="transport")
    with pytest.raises(ValueError, match="inside for 0.15 s, less than smallest = 0.2 s"):
        drive(block, grid(0.1, 1.0), wave, lambda t: 0.15)


@pytest.mark.parametrize("kind", KINDS)
def test_a_sample_that_is_not_there_yet_is_refused(kind: Any) -> None:
    block = VariableDelay(maximum=1.0, smallest=0.01, kind=kind)
    words = "delay = 0.05 s with smallest = 0.01 s asks for a sample that is not there at 0.05 s"
    with pytest.raises(ValueError, match=words):
        drive(block, grid(0.1, 1.0), wave, lambda t: 0.05)


def test_raising_the_bound_in_a_run_does_not_invent_history() -> None:
    block = VariableDelay(maximum=0.1, initial=5.0)
    x = block.start()
    for k in range(1000):
        _, x = block.step(x, k / 1000, 1.0, 0.1)
    wider = block.with_parameter("maximum", 2.0)
    assert wider.step(x, 1.0, 1.0, 0.1)[0] == 1.0
    assert wider.step(x, 1.0, 1.0, 1.5)[0] == 5.0  # before the start
    with pytest.raises(ValueError, match="maximum was raised in the run; samples before"):
        wider.step(x, 1.0, 1.0, 0.9)
