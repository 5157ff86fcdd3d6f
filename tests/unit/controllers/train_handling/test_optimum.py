"""Plans keep to what they must keep to, and are better than holding the speed."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from railcosim.base.errors import ParameterError, RailcosimError
from railcosim.controllers.train_handling import (
    Aims,
    Handling,
    HandlingDriver,
    Journey,
    RigidTrain,
    notched,
    optimal_handling,
)
from railcosim.models.consist import coal_train
from railcosim.models.line import beijing_line_5

from .trains import BRAKE, DESCENT, TRAIN, WAVES

JOURNEY = Journey(section=WAVES, start_speed=12.0, end_speed=13.0, time=145.0)
RATE = 30e3


@pytest.fixture(scope="module")
def plan() -> Handling:
    return optimal_handling(TRAIN, JOURNEY, node=25.0, rate=RATE)


def test_it_keeps_time_limits_and_envelopes(plan: Handling) -> None:
    assert plan.running_time == pytest.approx(145.0, abs=1e-5)
    assert plan.speed[[0, -1]] == pytest.approx([12.0, 13.0], abs=1e-6)
    assert plan.force[0] == pytest.approx(0.0, abs=1.0)
    lowered = (plan.position >= 1200.0) & (plan.position < 1700.0 + TRAIN.length)
    assert plan.speed.max() < 22.0 and plan.speed[lowered].max() < 16.0 + 1e-6
    for v, f in zip(plan.speed, plan.force, strict=True):
        assert -0.95 * float(TRAIN.electric_brake.at(v)) - 1.0 < f
        assert f < 0.95 * float(TRAIN.traction.at(v)) + 1.0
    assert np.abs(np.diff(plan.force) / np.diff(plan.time)).max() < RATE * (1.0 + 1e-6)


def test_the_train_does_move_so(plan: Handling) -> None:
    """Against scipy, with the force a straight line in the position."""
    rigid = RigidTrain(train=TRAIN, section=WAVES)

    def motion(s: float, y: np.ndarray) -> list[float]:
        v = float(np.sqrt(2.0 * y[0]))
        force = np.interp(s, plan.position, plan.force)
        return [float(rigid.acceleration(rigid.gradient_loads(s)[0][0], v, force)), 1.0 / v]

    end = solve_ivp(motion, (0.0, 2000.0), [72.0, 0.0], rtol=1e-8, max_step=5.0).y[:, -1]
    assert np.sqrt(2.0 * end[0]) == pytest.approx(13.0, abs=0.01)
    assert end[1] == pytest.approx(145.0, abs=0.05)


def cost(plan: Handling, aims: Aims) -> float:
    """The cost, by trapezoids over the time, with all couplers."""
    squares = np.mean(plan.coupler**2, axis=0)
    mean = np.trapezoid(squares, plan.time) / plan.running_time
    rates = np.mean(np.diff(plan.coupler, axis=1) ** 2, axis=0) / np.diff(plan.time)
    rate = rates.sum() / plan.running_time * aims.span**2
    peak = np.abs(plan.coupler).max() ** 2
    energy = aims.energy * np.mean(np.maximum(plan.force, 0.0)) / aims.force
    return float((aims.rms * mean + aims.peak * peak + aims.rate * rate) / aims.force**2 + energy)


def holding(speed: float) -> Handling:
    """The handling that holds a speed, from a train that is pulled already."""
    rigid = RigidTrain(train=TRAIN, section=WAVES)
    position = np.linspace(0.0, 2000.0, 81)
    speeds = np.full(81, speed)
    force = rigid.gradient_loads(position)[0] + rigid.resistance(speeds)
    none = np.zeros(81)
    coupler = rigid.coupler_forces(position, speeds, force)
    return Handling(
        position=position, speed=speeds, force=force, reduction=none, cylinder=none, coupler=coupler
    )


def test_it_beats_a_held_speed_in_the_same_time() -> None:
    held, aims = holding(14.0), Aims(force=50e3)
    journey = replace(JOURNEY, start_speed=14.0, end_speed=14.0, time=held.running_time)
    plan = optimal_handling(TRAIN, journey, aims=aims, node=25.0)
    assert cost(plan, aims) < 0.6 * cost(held, aims)
    ours, theirs = plan.figures(), held.figures()
    assert ours.time == pytest.approx(theirs.time, abs=1e-5)
    assert max(ours.tension, ours.compression) < 0.7 * max(theirs.tension, theirs.compression)
    assert ours.rms < theirs.rms and ours.traction < theirs.traction


def test_each_aim_is_best_met_by_the_plan_that_weighs_it() -> None:
    aims = Aims(force=50e3)
    words = ("rms", "peak", "rate", "energy")
    plans = [
        optimal_handling(TRAIN, JOURNEY, aims=replace(aims, **{word: 30.0}), node=50.0)
        for word in words
    ]
    for place, word in enumerate(words):
        none = dict.fromkeys(words, 0.0)
        values = [cost(plan, replace(aims, **{**none, "rms": 1e-12, word: 1.0})) for plan in plans]
        assert int(np.argmin(values)) == place, word


def test_a_time_that_cannot_be_names_one_that_can() -> None:
    with pytest.raises(ParameterError, match=r"takes at least \d+\.\d s, not 60 s") as refused:
        optimal_handling(TRAIN, replace(JOURNEY, time=60.0), node=50.0)
    least = float(str(refused.value).split("at least ")[1].split(" s")[0])
    plan = optimal_handling(TRAIN, replace(JOURNEY, time=least + 0.5), node=50.0)
    assert plan.running_time == pytest.approx(least + 0.5, abs=1e-4)


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ParameterError, match="cannot take 700 s; a plan keeps above 3 m/s"):
        replace(JOURNEY, time=700.0)
    with pytest.raises(ParameterError, match="speed at its start must be 3 to 22 m/s, not 25"):
        replace(JOURNEY, start_speed=25.0)
    with pytest.raises(ParameterError, match="must lead forward"):
        replace(JOURNEY, start=1500.0, end=1000.0)
    with pytest.raises(ParameterError, match="rms or rate above it"):
        Aims(rms=0.0, rate=0.0)
    with pytest.raises(ParameterError, match="no air brake to plan with"):
        optimal_handling(replace(TRAIN, brake=None), JOURNEY, air_brake=True)
    late = replace(JOURNEY, end=1750.0, end_speed=20.0, time=130.0)
    with pytest.raises(ParameterError, match="too fast; the limit of the whole train is 16 m/s"):
        optimal_handling(TRAIN, late)


plan_for = partial(optimal_handling, train=TRAIN, journey=JOURNEY)
journey_with = partial(replace, JOURNEY)
OF_ANOTHER_KIND: list[tuple[Any, dict[str, Any], str]] = [
    (plan_for, {"train": "t"}, "handling: train must be a ReducedTrain, not 't'; reduced_train"),
    (plan_for, {"train": coal_train()}, "train must be a ReducedTrain, not a Consist"),
    (plan_for, {"journey": WAVES}, "journey must be a Journey, not a Section"),
    (plan_for, {"aims": 1}, "aims must be an Aims, not 1; write aims=Aims"),
    (plan_for, {"node": "5"}, "node must be a number, not '5'"),
    (journey_with, {"section": beijing_line_5()}, "must be a Section, as .* not a Line"),
    (journey_with, {"section": "Mine"}, "journey: section must be a Section, .* not 'Mine'"),
    (journey_with, {"time": "850"}, "journey on 'waves': time must be a number, not '850'"),
    (journey_with, {"end": "East"}, "end must be a number, not 'East'"),
    (journey_with, {"start_speed": None}, "start_speed must be a number, not None"),
    (Aims, {"rms": "1"}, "aims: rms must be a number, not '1'"),
    (Aims, {"span": float("inf")}, "aims: span must be a number, not inf"),
    (RigidTrain, {"train": coal_train(), "section": WAVES}, "train must be a ReducedTrain, not a"),
    (RigidTrain, {"train": TRAIN, "section": None}, "must be a Section, .* not None"),
    (HandlingDriver.along, {"handling": JOURNEY}, "handling must be a Handling, not a Journey"),
    (notched, {"handling": JOURNEY, "rigid": 1, "notch": 1.0}, "must be a Handling, not a Journey"),
]


@pytest.mark.parametrize(("make", "options", "message"), OF_ANOTHER_KIND)
def test_what_is_of_another_kind_is_named(make: Any, options: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        make(**options)


def test_brakes_too_weak_for_the_descent() -> None:
    journey = Journey(section=DESCENT, start_speed=12.0, end_speed=12.0, time=290.0)
    weak = replace(TRAIN, electric_brake=replace(TRAIN.electric_brake, power=1e6))
    with pytest.raises(RailcosimError, match="brakes too weak"):
        optimal_handling(weak, journey, node=200.0)


def test_the_air_brake_is_applied_as_it_can_be() -> None:
    journey = Journey(section=DESCENT, start_speed=12.0, end_speed=12.0, time=290.0)
    plan = optimal_handling(TRAIN, journey, node=50.0, air_brake=True, aims=Aims(force=50e3))
    on = plan.reduction > 1.0
    assert on.any() and plan.reduction[on].min() > BRAKE.minimum - 1e-3
    both = on[:-1] & on[1:]
    assert np.diff(plan.reduction)[both].min() > -1e-3
    edges = plan.time[1:][np.diff(on.astype(int)) != 0]
    assert np.diff(edges).min() > 30.0 - 50.0 / 10.0
    # The cylinders, against scipy with the time constant that applies.
    r = np.interp(t := np.linspace(0.0, plan.running_time, 3000), plan.time, plan.reduction)
    reductions, coefficients = zip(*BRAKE.service, strict=True)
    settled = np.interp(r, reductions, coefficients)

    def flow(now: float, p: np.ndarray) -> np.ndarray:
        lag = np.interp(now, t, settled) - p
        return lag / np.where(lag > 0.0, BRAKE.application_time, BRAKE.release_time)

    p = solve_ivp(flow, (0.0, t[-1]), [0.0], t_eval=plan.time, max_step=0.5).y[0]
    assert np.abs(p - plan.cylinder).max() < 0.05
