"""The driver by plan, sample by sample."""

import math
from dataclasses import replace

import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers.train_handling import HandlingDriver

DRIVER = HandlingDriver(
    position=(0.0, 100.0, 200.0),
    speed=(10.0, 12.0, 11.0),
    force=(0.0, 100e3, -50e3),
    reduction=(0.0, 0.0, 60.0),
    gain=10e3,
    rate=1e9,
)
FREE = (math.inf, -math.inf)


@pytest.mark.parametrize(
    ("position", "speed", "force", "reduction"),
    [
        (50.0, 11.0, 50e3, 0.0),  # on the plan
        (50.0, 10.5, 55e3, 0.0),  # half a metre per second too slow
        (150.0, 11.5, 25e3, 30.0),
        (-10.0, 10.0, 0.0, 0.0),  # before and behind the plan its ends hold
        (999.0, 11.0, -50e3, 60.0),
    ],
)
def test_force_by_place_and_speed(
    position: float, speed: float, force: float, reduction: float
) -> None:
    found, _ = DRIVER.step(DRIVER.start(), position, speed, *FREE)
    assert found == pytest.approx((force, reduction))


def test_limits_and_rate() -> None:
    (force, _), _ = DRIVER.step(DRIVER.start(), 100.0, 12.0, 80e3, -10e3)
    assert force == 80e3
    slow = replace(DRIVER, rate=50e3, period=0.1)
    (force, _), state = slow.step(slow.start(), 100.0, 12.0, *FREE)
    assert force == 5e3
    assert slow.step(state, 100.0, 12.0, *FREE)[0][0] == 10e3


def test_the_lever_stays_until_it_is_far_off() -> None:
    lever = replace(DRIVER, notch=10e3)
    state, levels = lever.start(), []
    for position in (7.0, 8.0, 12.0, 17.0, 18.0, 13.0, 12.0):  # 1 kN a metre
        target = 10.0 + 0.02 * position
        (force, _), state = lever.step(state, position, target, *FREE)
        levels.append(force / 10e3)
    assert levels == [0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 1.0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speed": (10.0, 12.0)}, "speed needs a number for each"),
        ({"position": (0.0, 200.0, 100.0)}, "places must rise"),
        ({"force": (0.0, math.nan, 1.0)}, "force needs a number"),
        ({"rate": 0.0}, "rate must be a positive number"),
        ({"notch": -1.0}, "must not be negative"),
    ],
)
def test_drivers_that_cannot_be(change: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        replace(DRIVER, **change)  # pyright: ignore[reportArgumentType]
