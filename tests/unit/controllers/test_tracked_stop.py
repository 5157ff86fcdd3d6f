"""A tracked stop: what its law is told in each loop mode, and that it can be traced whole."""

import random
from dataclasses import replace
from typing import Any

import pytest

from railcosim import Block
from railcosim.base.errors import ParameterError
from railcosim.controllers import (
    SMARC,
    BrakeModel,
    BrakingProfile,
    DelayPredictor,
    DisturbanceObserver,
    PositionPID,
    SlidingMode,
    SpeedPID,
    StopCommand,
    TrackedStop,
)
from tests.systems.metro_stop_reference import Numbers, Stop
from tests.tracing import largest_difference

PROFILE = BrakingProfile(lead_in=1.0)
START = PROFILE.start_position
LAWS: dict[str, Block] = {
    "smarc": SMARC(surface=0.3, reaching=0.1, robust=0.05, adaptation=0.5, boundary=0.3),
    "smarc_sign": SMARC(surface=0.3, reaching=0.1, robust=0.05, adaptation=0.5),
    "smc": SlidingMode(surface=0.3, reaching=0.1, robust=0.05),
    "pid": SpeedPID(kp=0.5, ki=0.1, kd=0.2),
    "position_pid": PositionPID(kp=0.1, ki=0.01, kd=0.5),
}
PREDICTOR = DelayPredictor(
    observer=DisturbanceObserver(gain=0.1, air_gain=0.1), electric_lead=0.8, air_lead=0.3,
    position_gain=0.2, speed_gain=0.2, initial_position=START,
)  # fmt: skip


def test_without_predictor_the_errors_are_those_of_now() -> None:
    """PID with kp alone, by hand, 5 s after the start; the feed-forward may be of later."""
    model = BrakeModel(approach=3.0)
    plain = TrackedStop(law=SpeedPID(kp=0.4), profile=PROFILE, model=model)
    target = PROFILE.at(5.0)
    x = (25.0, (), plain.law.start(), -0.1)
    resistance = model.resistance(-150.0, 12.0)
    feedback = 0.4 * (12.0 - target.speed)
    u, following = plain.step(x, -150.0, 12.0)
    assert u == pytest.approx((target.acceleration + resistance) / 0.85 - feedback)
    assert following[0] == 26.0
    shifted = replace(plain, shift=1.5, profile=replace(PROFILE, lead_in=4.0))
    u, _ = shifted.step(x, -150.0, 12.0)
    later = shifted.profile.at(6.5).acceleration
    assert later < shifted.profile.at(5.0).acceleration
    feedback = 0.4 * (12.0 - shifted.profile.at(5.0).speed)
    assert u == pytest.approx((later + resistance) / 0.85 - feedback)


def test_with_a_predictor_the_errors_are_those_at_its_horizon() -> None:
    block = TrackedStop(
        law=SpeedPID(kp=0.1),
        profile=PROFILE,
        predictor=PREDICTOR,
        limiter=StopCommand(limits=(-3.0, 3.0)),
    )
    x = block.start()
    for k in range(20):
        before, last = x, x[3]
        seen = (START + 2.8 * k, 14.0 - 0.04 * k)
        u, x = block.step(before, *seen)
        (s, v, horizon, _, disturbance), _ = PREDICTOR.step(before[1], *seen, last)
        assert horizon == pytest.approx(1.7)
        target = PROFILE.at(k * 0.2 + horizon)
        wanted = target.acceleration + block.model.resistance(s, v) - disturbance
        assert u == pytest.approx(wanted / 0.85 - 0.1 * (v - target.speed))


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("mode", ["m0", "m1", "m2"])
def test_traced_is_the_same(name: str, mode: str) -> None:
    """At every state of a noisy stop."""
    block = TrackedStop(
        law=LAWS[name], profile=PROFILE, shift=0.9 if mode == "m1" else 0.0,
        predictor=PREDICTOR if mode == "m2" else None,
    )  # fmt: skip
    generator = random.Random(9)
    states: list[Any] = []
    points: list[Any] = []
    x = [block.start()]

    def command(k: int, position: float, speed: float) -> float:
        states.append(x[0])
        points.append((position + generator.gauss(0, 0.02), speed + generator.gauss(0, 0.02)))
        u, x[0] = block.step(x[0], *points[-1])
        return u

    stop = Stop(Numbers(start=START, inner=0.1), command)
    assert abs(stop.position) < 20.0
    assert largest_difference(block, states, points) <= 1e-9


def test_parts_of_another_period_are_refused() -> None:
    with pytest.raises(ParameterError, match="all parts must have its period"):
        TrackedStop(law=SpeedPID(kp=0.4, period=0.1))


def test_the_aim_is_a_parameter() -> None:
    block = TrackedStop(law=SpeedPID(kp=0.4)).with_parameter("profile.aim", -0.12)
    assert block.profile.aim == -0.12
