"""The predictive stop in the loop with the train's FMU."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers.odometry import Odometry
from railcosim.controllers.predictive_stop import Plan, PredictiveStop
from railcosim.studies.precise_braking.loop import braking_loop
from railcosim.studies.precise_braking.stops import (
    AIR,
    ELECTRIC,
    START,
    learning_chain,
    nominal,
    one_stop,
    predictive,
    run_stop,
)


def test_v3_stops_are_within_30_cm() -> None:
    rows = [one_stop({}, np.random.default_rng([101, k]), train="v3") for k in range(40)]
    errors = np.array([row["stop_error"] for row in rows])
    assert all(row["stopped"] == 1.0 for row in rows)
    assert np.abs(errors).max() < 30.0
    assert errors.std() < 4.5
    assert max(row["command_travel"] for row in rows) < 3.0


def test_knowing_all_leaves_less_than_2_cm() -> None:
    for k in range(4):
        row = one_stop({}, np.random.default_rng([102, k]), known=(*ELECTRIC, *AIR))
        assert abs(row["stop_error"]) < 2.0


def test_learns() -> None:
    rows = learning_chain({"station": 3}, np.random.default_rng(103), train="v6", stops=12)
    later = np.array([row["stop_error"] for row in rows[2:]])
    assert np.sqrt((later**2).mean()) < 8.0


def test_real_odometry() -> None:
    """A wheel 1.2 % too large, with three balises: the scale is estimated on the way."""
    known = nominal("v3", 1)
    sensors = Odometry(scale=0.012, balises=(120.0, 20.0, 5.0), seed=4)
    controller = predictive(known, scale=0.007, balises=sensors.balises)
    run = run_stop(known, controller, sensors, "controller.scale")
    assert abs(run["train.position"][-1]) < 0.1
    assert run["controller.scale"][-1] == pytest.approx(0.012, abs=1e-3)


def test_same_bits_again() -> None:
    first, again = (one_stop({}, np.random.default_rng(104)) for _ in range(2))
    assert first == again


def test_goes_on_from_a_checkpoint() -> None:
    known = nominal("v6", 2)
    loop = braking_loop(known, predictive(known), Odometry(seed=1), start=START)
    whole = loop.run(32.0)
    with loop.simulation() as simulation:
        kept = simulation.advance(21.05).checkpoint()
    rest = loop.run(32.0, resume=kept)
    for name in ("train.position", "controller.command", "controller.air_gain"):
        assert rest[name][-1] == whole[name][-1]


def test_rises_to_the_braking_level_once_and_holds() -> None:
    """Without noise and with everything known the level hardly moves after it is reached."""
    known = nominal("v3", 1)
    controller = predictive(known)
    quiet = Odometry(position_noise=0.0, speed_noise=0.0)
    run = run_stop(known, controller, quiet, "controller.level")
    assert run["train.position"][-1] == pytest.approx(0.0, abs=0.02)
    command = run["controller.command"]
    steps = np.diff(command[: np.flatnonzero(run["train.standstill"] == 1)[0]])
    assert np.abs(steps).max() <= 0.12 + 1e-12
    assert np.abs(steps).sum() == pytest.approx(command[0] - command.min(), abs=0.06)


def test_far_away_it_cruises_and_remembers_nothing() -> None:
    controller = predictive(nominal("v6", 0))
    (command, _, _, phase, *_), x = controller.step(controller.start(), -900.0, 14.0)
    assert phase == 0
    # −3 ‰ and 9.758 N/kN of running resistance at 50.4 km/h
    assert command == pytest.approx((9.7557 - 3.0) * 9.81e-3 / 0.85, rel=1e-3)
    assert x[-1] == ((), (), ())


def test_wrong_numbers_are_refused() -> None:
    good = predictive(nominal("v6", 0))
    for change, words in (
        ({"period": 0.1}, "period must be the model's"),
        ({"braking": -1.0}, "braking"),
        ({"iterations": 0}, "iterations"),
        ({"plan": Plan(damping=0.0)}, "damping"),
        ({"plan": Plan(slow=2.0, fast=1.0)}, "slow < fast"),
    ):
        with pytest.raises(ParameterError, match=words):
            replace(good, **change)
    assert isinstance(good, PredictiveStop)
