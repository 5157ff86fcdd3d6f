"""A plan by notches."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers.train_handling import (
    Handling,
    Journey,
    RigidTrain,
    notched,
    optimal_handling,
)

from .trains import TRAIN, WAVES

RIGID = RigidTrain(train=TRAIN, section=WAVES)
NOTCH = 18.75e3


@pytest.fixture(scope="module")
def plan() -> Handling:
    journey = Journey(section=WAVES, start_speed=12.0, end_speed=13.0, time=145.0)
    return optimal_handling(TRAIN, journey, node=25.0)


def test_the_force_rests_on_notches(plan: Handling) -> None:
    found = notched(plan, RIGID, notch=NOTCH, rate=30e3)
    assert found.notch == NOTCH
    rests = np.diff(found.force) == 0.0
    levels = found.force[1:][rests] / NOTCH
    assert rests.mean() > 0.5
    assert levels == pytest.approx(np.round(levels), abs=1e-9)
    assert np.abs(np.diff(found.force) / np.diff(found.time)).max() < 31e3


def test_the_train_stays_with_the_plan(plan: Handling) -> None:
    found = notched(plan, RIGID, notch=NOTCH, gain=50e3)
    assert found.running_time == pytest.approx(plan.running_time, rel=0.005)
    off = found.speed - np.interp(found.position, plan.position, plan.speed)
    assert np.abs(off).max() < 0.3
    # The planned places' forces are those of the handling itself.
    again = RIGID.coupler_forces(found.position, found.speed, found.force)
    assert again == pytest.approx(found.coupler)


def test_finer_notches_come_to_the_plan(plan: Handling) -> None:
    times = [
        abs(notched(plan, RIGID, notch=notch, rate=1e6).running_time - plan.running_time)
        for notch in (40e3, 1e3)
    ]
    assert times[1] < 0.05 and times[1] <= times[0]


def test_notches_that_cannot_be(plan: Handling) -> None:
    with pytest.raises(ParameterError, match="must be positive, not 0"):
        notched(plan, RIGID, notch=0.0)
    uphill = replace(WAVES, gradients=((0.0, 10.0),))
    with pytest.raises(ParameterError, match="would halt; notches of 1000 kN are too coarse"):
        notched(plan, RigidTrain(train=TRAIN, section=uphill), notch=1e6)
