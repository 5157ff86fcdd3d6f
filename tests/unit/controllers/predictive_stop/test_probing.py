"""The predictive stop that tries the air brake out: what it sends, and what that is good for."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers.odometry import Odometry
from railcosim.controllers.predictive_stop import PARAMETERS, Probe
from railcosim.studies.precise_braking.stops import (
    AIR,
    ELECTRIC,
    PERIOD,
    learning_chain,
    nominal,
    one_stop,
    predictive,
    probing,
    run_stop,
    samples_of,
)


def test_the_air_brake_is_tried_out_two_seconds_after_braking_has_begun() -> None:
    known = nominal("v6", 2)
    record = ["controller.probe", "controller.phase", "probe_delay.y", "train.air"]
    run = run_stop(known, probing(known), Odometry(seed=1), *record)
    begun = run.time[np.flatnonzero(run["controller.phase"] == 2)[0]]
    asked = run.time[run["controller.probe"] < 0.0]
    assert set(run["controller.probe"]) == {0.0, -0.2}
    assert (asked[0], asked[-1]) == pytest.approx((begun + 2.0, begun + 3.99), abs=1e-9)
    came = run.time[run["probe_delay.y"] < 0.0]
    assert (came[0], came[-1]) == pytest.approx((asked[0] + 0.8, asked[-1] + 0.8), abs=1e-9)
    # A lag's answer; φ rises from 0.80 at 14 m/s.
    at = np.searchsorted(run.time, came[-1])
    grip = 85.16e-2 * 0.2 * (1.0 - np.exp(-2.0 / 1.741))
    assert 0.79 * grip < -run["train.air"][at] < 0.85 * grip
    assert not run["train.air"][: np.searchsorted(run.time, came[0])].any()


def test_knowing_all_leaves_less_than_2_cm() -> None:
    """So what the controller predicts of the probe is what the train does."""
    for k in range(3):
        row = one_stop({}, np.random.default_rng([102, k]), make=probing, known=(*ELECTRIC, *AIR))
        assert abs(row["stop_error"]) < 2.0


def test_it_teaches_the_air_brake_before_the_changeover() -> None:
    """Of the same truths: the air brake's gain is nearer, and so is the stop."""
    gains, stops = [], []
    for k in range(12):
        generator = np.random.default_rng([105, k])
        about = nominal("v6", k % 7)
        truth = about.drawn(generator)
        true = truth.air_gain / truth.mass_ratio
        for make in (predictive, probing):
            record = ["controller.air_gain", "train.phase"]
            run = run_stop(truth, make(about), Odometry(seed=k), *record)
            before = np.flatnonzero(run["train.phase"] == 2)[0]
            gains.append(run["controller.air_gain"][before] - true)
            stops.append(100.0 * run["train.position"][-1])
    without, probed = np.array(gains).reshape(-1, 2).T
    assert np.abs(probed).mean() < 0.8 * np.abs(without).mean()
    without, probed = np.array(stops).reshape(-1, 2).T
    assert np.sqrt((probed**2).mean()) < np.sqrt((without**2).mean())
    assert np.abs(probed).max() < 30.0


def test_samples_know_when_it_was() -> None:
    known = nominal("v6", 3)
    controller = probing(known)
    record = ["odometry.position", "odometry.speed", "controller.probe", "controller.phase"]
    record += [f"controller.{name}" for name in PARAMETERS]
    run = run_stop(known, controller, Odometry(seed=2), *record)
    _, samples = samples_of(run, controller.model.probe)
    awake = run.time[np.flatnonzero(run["controller.phase"] >= 1)[0]]
    begun = run.time[np.flatnonzero(run["controller.probe"] < 0.0)[0]]
    assert samples.probed == pytest.approx(begun - awake, abs=1e-9)
    assert samples.commands[round(samples.probed / PERIOD)] < -0.5  # while the motors brake


def test_learns() -> None:
    chain = learning_chain({"station": 3}, np.random.default_rng(103), way="probing", stops=8)
    later = np.array([row["stop_error"] for row in chain[2:]])
    assert np.sqrt((later**2).mean()) < 8.0


def test_wrong_numbers_are_refused() -> None:
    good = probing(nominal("v6", 0))
    for probe, words in (
        (None, "must have a probe"),
        (Probe(level=0.1), "level must be ≤ 0, not 0.1"),
        (Probe(length=0.3), "length must be whole periods of 0.2 s, not 0.3"),
        (Probe(length=0.0), "length"),
        (Probe(after=-0.2), "after"),
    ):
        with pytest.raises(ParameterError, match=words):
            replace(good, model=replace(good.model, probe=probe))
