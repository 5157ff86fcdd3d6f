"""The predictor tells what the nominal train will do, from the commands that are under way."""

import math
import random
from dataclasses import replace
from typing import Any

import casadi as ca
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers import BrakeModel, DelayPredictor, DisturbanceObserver
from railcosim.fmus.tracing import flat
from tests.systems.metro_stop_reference import Numbers, Stop
from tests.tracing import largest_difference

SMOOTH: dict[str, float] = {"davis_a": 0.0, "davis_b": 0.0, "davis_c": 0.0}


def commands(k: int) -> float:
    """Steps up and down about −0.7, different at each sample, after 1 s of coasting."""
    return 0.0 if k < 5 else -0.7 + 0.25 * math.sin(1.7 * k)


def predictions(predictor: DelayPredictor, numbers: Numbers) -> tuple[Stop, list[Any]]:
    """Run the true train under given commands; return it and what was predicted by sample."""
    found: list[Any] = []
    x = [predictor.start()]

    def command(k: int, position: float, speed: float) -> float:
        y, x[0] = predictor.step(x[0], position, speed, commands(k - 1) if k else 0.0)
        found.append(y)
        return commands(k)

    return Stop(numbers, command), found


def nominal(model: BrakeModel, **options: Any) -> DelayPredictor:
    return DelayPredictor(model=model, initial_position=-200.0, **options)


def errors(stop: Stop, found: list[Any], delay: float, phase: range) -> list[float]:
    """Return the errors of position and speed, at all samples whose horizon ends at a sample."""
    ahead = round(delay / 0.2)
    pairs = [(found[k], stop.states[k + ahead]) for k in phase if k + ahead < len(stop.states)]
    return [abs(y[i] - s[i]) for y, s in pairs for i in (0, 1)]


@pytest.mark.parametrize("delay", [0.6, 1.0])
def test_it_is_exact_for_the_nominal_train_on_the_electric_brake(delay: float) -> None:
    """Lags are exact, whatever the commands; without running resistance nothing is left over."""
    model = BrakeModel(electric_delay=delay, air_delay=0.74, platform=0.0, **SMOOTH)
    numbers = Numbers(t1=delay, t3=0.74, davis=(0.0, 0.0, 0.0))
    stop, found = predictions(nominal(model), numbers)
    slow = next(k for k, s in enumerate(stop.states) if s[1] < 2.6)
    assert slow > 80
    assert max(errors(stop, found, delay, range(slow))) < 1e-9


def test_it_needs_no_measurement_of_the_nominal_train() -> None:
    """With gains of 0 the estimate runs by itself: off-grid delays, exact all the same."""
    model = BrakeModel(electric_delay=0.93, air_delay=0.77, **SMOOTH)
    numbers = Numbers(t1=0.93, t3=0.77, davis=(0.0, 0.0, 0.0))
    blind = nominal(model, position_gain=0.0, speed_gain=0.0, electric_lead=0.27)
    stop, _ = predictions(blind, numbers)
    state = blind.start()
    for k, truth in enumerate(stop.states[:80]):
        seen = truth if k == 0 else (1e3, 1e3)
        _, state = blind.step(state, float(seen[0]), float(seen[1]), commands(k - 1) if k else 0.0)
        assert state[0][:2] == pytest.approx(truth[:2], abs=1e-8)


def test_it_is_good_to_millimetres_through_the_changeover_to_the_air_brake() -> None:
    """Here speed-dependent terms and the fading share are those of the middle of each part."""
    model = BrakeModel(electric_delay=0.8, air_delay=0.8, approach=-3.0, platform=2.0)
    numbers = Numbers(t1=0.8, t3=0.8, approach=-3.0, platform=2.0)
    stop, found = predictions(nominal(model), numbers)
    assert max(errors(stop, found, 0.8, range(len(stop.states)))) < 3e-3
    assert found[-1][0] == pytest.approx(stop.position, abs=3e-3)


def test_it_sees_ahead_by_delay_and_lead() -> None:
    model = BrakeModel(**SMOOTH)
    lead = nominal(model, electric_lead=0.5, air_lead=0.3)
    stop, found = predictions(lead, Numbers(davis=(0.0, 0.0, 0.0)))
    assert found[10][2] == pytest.approx(1.4)
    assert found[len(stop.states) - 1][2] == pytest.approx(1.1)


def test_the_observer_corrects_a_train_that_brakes_too_much() -> None:
    """P1 is 6 % more than the model's: the error over the horizon falls to a tenth."""
    model = BrakeModel(electric_delay=1.0)
    numbers = Numbers(t1=1.0, p1=0.9, approach=0.0)

    def steady(predictor: DelayPredictor) -> float:
        found, x = [], [predictor.start()]

        def command(k: int, position: float, speed: float) -> float:
            y, x[0] = predictor.step(x[0], position, speed, -0.8 if k else 0.0)
            found.append(y)
            return -0.8

        stop = Stop(numbers, command)
        return max(errors(stop, found, 1.0, range(50, 60)))

    plain = steady(nominal(model))
    helped = steady(nominal(model, observer=DisturbanceObserver(gain=0.15), speed_gain=0.3))
    assert plain > 0.015
    assert helped < 0.1 * plain


@pytest.mark.parametrize("observer", [None, DisturbanceObserver(gain=0.1, air_gain=0.1)])
def test_traced_is_the_same(observer: DisturbanceObserver | None) -> None:
    """At the states of a noisy stop, with delays off the grid."""
    generator = random.Random(12)
    predictor = nominal(
        BrakeModel(electric_delay=0.93, approach=2.0), observer=observer, electric_lead=0.9,
        air_lead=0.3, position_gain=0.2, speed_gain=0.3,
    )  # fmt: skip
    states: list[Any] = []
    points: list[Any] = []
    x = [predictor.start()]

    def command(k: int, position: float, speed: float) -> float:
        seen = (position + generator.gauss(0.0, 0.02), speed + generator.gauss(0.0, 0.02))
        states.append(x[0])
        points.append((*seen, commands(k - 1)))
        _, x[0] = predictor.step(x[0], *points[-1])
        return commands(k)

    Stop(Numbers(t1=0.93, t3=0.85), command)
    assert len(flat(states[0])) >= 12
    assert largest_difference(predictor, states, points) <= 1e-9


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"electric_lead": 3.0, "longest_lead": 2.0},
            "electric_lead must lie between 0 and 2 s, not 3",
        ),
        ({"air_lead": -0.1}, "air_lead must lie between 0 and inf s"),
        ({"period": 0.0}, "period must be a positive number"),
        (
            {"observer": DisturbanceObserver(gain=0.1, period=0.1)},
            "the observer must have its period",
        ),
        (
            {"model": replace(BrakeModel(), air_delay=ca.SX.sym("d"))},
            "delays must be numbers, not symbols",
        ),
        ({"electric_lead": ca.SX.sym("lead")}, "longest_lead must be given for a symbol"),
    ],
)
def test_wrong_parameters_are_refused(options: Any, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        replace(DelayPredictor(), **options)
