"""The air brake of the Newmark reference, against what is known without it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from railcosim.models.consist import Consist, EndOfTrain, coal_train
from railcosim.studies.heavy_haul.newmark import simulate
from railcosim.studies.heavy_haul.newmark_brake import AirBrake

LEVEL = ((0.0, 0.0),)
Array = NDArray[Any]


def pipe(consist: Consist, sources: Callable[[float], Array], stop: float) -> tuple[Array, Array]:
    """Return times and the pipe's reductions (kPa) along the train, in steps of 10 ms."""
    brake, step = AirBrake(consist), 1e-2
    rows = [brake.reduction]
    for k in range(round(stop / step)):
        brake.advance(step, sources(k * step), sources((k + 1) * step))
        rows.append(brake.reduction)
    return step * np.arange(len(rows)), np.array(rows)


def test_the_brake_wave_arrives_with_its_speed() -> None:
    time, reduction = pipe(coal_train(), lambda t: np.array([100.0 * min(t / 0.01, 1.0)]), 12.0)
    lengths = np.array([each.length for each in coal_train().vehicles])
    mean = np.trapezoid(1.0 - reduction / 100.0, time, axis=0) - 0.005  # of the arrival, in s
    np.testing.assert_allclose(mean, np.cumsum(lengths) / 250.0, atol=1e-4)
    arrival = np.array([np.interp(50.0, row, time) for row in reduction.T])
    assert arrival[-1] == pytest.approx(lengths.sum() / 250.0, abs=0.05)


def check_from_both_ends(mean: Any, front: Array, rear: Array) -> None:
    """Check the arrivals (s): where both waves meet, their larger is a little before either."""
    late = mean - np.minimum(front, rear)
    meet = np.abs(front - rear) < 0.2
    assert 0 < np.count_nonzero(meet) < 6
    np.testing.assert_allclose(late[~meet], 0.0, atol=0.01)
    assert (np.abs(late[meet] + 0.02) < 0.03).all()


def test_the_brake_wave_enters_at_the_end_too() -> None:
    consist = coal_train(end_of_train=EndOfTrain(radio_delay=1.0))
    time, reduction = pipe(consist, lambda t: np.array([100.0, 100.0 * (t >= 1.0)]), 8.0)
    mean = np.trapezoid(1.0 - reduction / 100.0, time, axis=0)
    lengths = np.array([each.length for each in consist.vehicles])
    front, rear = np.cumsum(lengths) / 250.0, 1.0 + np.cumsum(lengths[::-1])[::-1] / 250.0
    check_from_both_ends(mean, front, rear)


def test_a_device_that_is_not_commanded_leaves_the_train_to_the_front_s_wave() -> None:
    bare, device = coal_train(wagons=30), coal_train(wagons=30, end_of_train=EndOfTrain())
    _, expected = pipe(bare, lambda t: np.array([100.0 * (t < 6.0)]), 12.0)
    _, found = pipe(device, lambda t: np.array([100.0 * (t < 6.0), 0.0]), 12.0)
    np.testing.assert_array_equal(found, expected)
    assert found.max(axis=0).min() > 99.0


def test_a_release_comes_from_the_front_and_steps_add_up() -> None:
    """50 kPa, then 100, then a release: the second step and the release by themselves."""
    consist = coal_train(end_of_train=EndOfTrain())

    def handle(t: float) -> float:
        return 0.0 if t < 0.0 or t >= 24.0 else 50.0 if t < 12.0 else 100.0

    time, reduction = pipe(consist, lambda t: np.array([handle(t), handle(t - 1.0)]), 36.0)
    lengths = np.array([each.length for each in consist.vehicles])
    front, rear = np.cumsum(lengths), np.cumsum(lengths[::-1])[::-1]
    second, release = (time >= 12.0) & (time < 24.0), time >= 24.0
    mean = np.trapezoid((100.0 - reduction[second]) / 50.0, time[second], axis=0)
    check_from_both_ends(mean, front / 250.0, 1.0 + rear / 250.0)
    mean = np.trapezoid(reduction[release] / 100.0, time[release], axis=0)
    np.testing.assert_allclose(mean, front / 160.0, atol=0.01)
    assert (np.diff(reduction[~release], axis=0) > -1e-9).all()  # nowhere a dip as they meet


def test_pipe_and_cylinders_are_integrated_exactly() -> None:
    consist = coal_train(locomotives=1, wagons=3)

    def command(t: float) -> float:
        return float(np.interp(t, [0.0, 0.5, 3.0, 3.5], [0.0, 120.0, 120.0, 30.0]))

    lengths = np.array([each.length for each in consist.vehicles])
    points = np.array([(0, 0), (50, 0.17), (60, 0.28), (70, 0.37), (80, 0.46), (90, 0.53),
                       (100, 0.60), (110, 0.67), (120, 0.73)]).T  # fmt: skip

    def rates(t: float, state: Array) -> Array:
        r, p = state[:4], state[4:]
        rise = np.concatenate(([command(t)], r[:-1])) - r
        lack = np.array([0.0, 1.0, 1.0, 1.0]) * 420e3 * np.interp(r, *points) - p
        return np.concatenate((
            rise * np.where(rise > 0.0, 250.0, 160.0) / lengths,
            lack / np.where(lack > 0.0, 4.0, 8.0),
        ))  # fmt: skip

    truth: Any = solve_ivp(rates, (0.0, 6.0), np.zeros(8), rtol=1e-10, atol=1e-6, max_step=0.01)
    run = simulate(consist, stop=6.0, step=5e-3, reduction=command, gradients=LEVEL, record=1200)
    np.testing.assert_allclose(run.reduction[-1], truth.y[:4, -1], atol=1e-4)
    np.testing.assert_allclose(run.pressure[-1], truth.y[4:, -1], rtol=1e-6)
