"""The metro stop in the loop, FMU, delays and controllers, against a reference written apart."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from railcosim import Block
from railcosim.base.errors import ParameterError
from railcosim.controllers import SMARC, BrakeModel, BrakingProfile, StopCommand, TrackedStop
from railcosim.controllers.odometry import Odometry
from railcosim.studies.precise_braking.controllers import LAWS, TRIMS, controller, maker
from railcosim.studies.precise_braking.loop import START, braking_loop
from railcosim.studies.precise_braking.stations import STATIONS
from railcosim.studies.precise_braking.truth import V6, Truth
from tests.systems.metro_stop_reference import Numbers, Stop, smarc

IDEAL = Odometry(position_noise=0.0, speed_noise=0.0)


def nominal(station: int) -> Truth:
    place = STATIONS[station]
    return replace(V6, approach=place.approach, platform=place.platform)


def drawn(seed: int, station: int) -> Truth:
    return nominal(station).drawn(np.random.default_rng(seed))


def numbers(truth: Truth) -> Numbers:
    return Numbers(
        t1=truth.electric_delay, t2=truth.electric_lag, p1=truth.electric_coefficient,
        mu=truth.mass_ratio, t3=truth.air_delay, t4=truth.air_lag, k=truth.air_gain,
        v_sw=truth.changeover_speed, k_bra=truth.fade_rate, approach=truth.approach,
        platform=truth.platform, speed=truth.speed, start=START + truth.position,
        davis=(2.031 * truth.davis, 0.0622 * truth.davis, 0.001807 * truth.davis),
    )  # fmt: skip


def stopped(truth: Truth, block: Block, *, step: float = 0.2, odometry: Block = IDEAL) -> Any:
    return braking_loop(truth, block, odometry, start=START, step=step).run(40.0)


def final(run: Any) -> float:
    assert run["train.standstill"][-1] == 1.0
    return float(run["train.position"][-1])


@pytest.mark.parametrize("seed", range(3))
def test_the_loop_equals_the_reference_with_the_same_commands(seed: int) -> None:
    """The commands of the run drive the reference: plants, delays and events are compared."""
    truth = drawn(seed, seed)
    run = stopped(truth, controller("smarc_dob_m2", seed), odometry=Odometry(seed=seed))
    commands = run["controller.command"].tolist()
    stop = Stop(numbers(truth), lambda k, s, v: commands[k])
    assert final(run) == pytest.approx(stop.position, abs=1e-6)
    truths = np.array(stop.states)
    for column, name in enumerate(("position", "speed")):
        recorded = run[f"train.{name}"][: len(truths)]
        assert recorded == pytest.approx(truths[:, column], abs=1e-6)


@pytest.mark.parametrize("name", ["smarc_dob_m2", "pid_m0", "smc_m2"])
def test_the_loop_equals_the_reference_with_the_same_controller(name: str) -> None:
    """The controller's block is stepped by the reference too: the whole loop is compared."""
    truth, block = drawn(11, 3), controller(name, 3)
    x = [block.start()]

    def command(k: int, position: float, speed: float) -> float:
        u, x[0] = block.step(x[0], position, speed)
        return u

    stop = Stop(numbers(truth), command)
    assert final(stopped(truth, block)) == pytest.approx(stop.position, abs=1e-5)


def test_a_controller_written_anew_stops_at_the_same_place() -> None:
    """The paper's SMARC without prediction; nothing in the reference is the package's.

    The speed is not the target's, or the first sgn(z) would be one of rounding errors.
    """
    truth = replace(nominal(0), speed=14.1)
    model = BrakeModel(approach=truth.approach, platform=truth.platform)
    begin = BrakingProfile().start_position
    law = SMARC(surface=0.28, reaching=0.2, robust=0.1, adaptation=0.25)
    block = TrackedStop(
        law=law, model=model, profile=BrakingProfile(),
        limiter=StopCommand(initial=truth.cruising),
    )  # fmt: skip
    written = smarc(c=0.28, k_s=0.2, eta=0.1, lam=0.25, approach=truth.approach, start=begin)
    run = braking_loop(truth, block, IDEAL, start=begin, step=0.2).run(40.0)
    stop = Stop(replace(numbers(truth), start=begin), written)
    assert final(run) == pytest.approx(stop.position, abs=1e-6)
    count = len(stop.commands)
    assert run["controller.command"][:count] == pytest.approx(np.array(stop.commands), abs=1e-6)


@pytest.mark.parametrize("name", ["smarc_dob_m2", "smarc_m0"])
def test_the_base_step_does_not_matter(name: str) -> None:
    """With delays off every grid, drawn at random."""
    truth, odometry = drawn(7, 1), Odometry(seed=7)
    places = [
        final(stopped(truth, controller(name, 1), step=step, odometry=odometry))
        for step in (0.2, 0.1, 0.02)
    ]
    assert np.ptp(places) < 1e-6


@pytest.mark.parametrize("station", range(len(STATIONS)))
def test_the_nominal_train_stops_within_10_cm(station: int) -> None:
    run = stopped(nominal(station), controller("smarc_dob_m2", station))
    assert abs(final(run)) < 0.10


def test_drawn_trains_stop_within_the_doors() -> None:
    """A few of many: none beyond 60 cm, most within 30."""
    misses = [
        abs(final(stopped(drawn(s, s % 7), controller("smarc_dob_m2", s % 7),
                          odometry=Odometry(seed=s))))
        for s in range(100, 114)
    ]  # fmt: skip
    assert max(misses) < 0.6
    assert np.mean(np.array(misses) < 0.3) > 0.9


@pytest.mark.parametrize("name", LAWS)
def test_a_controller_is_made_by_station_or_from_nominal_numbers(name: str) -> None:
    for station in range(len(STATIONS)):
        made = controller(name, station)
        assert maker(name)(nominal(station)) == made
        assert made.profile.start_position == pytest.approx(START + made.profile.aim, abs=1e-9)
        assert made.profile.aim == -0.01 * TRIMS.get(name, (0.0,) * 7)[station]
    assert controller(name, 2, train="v12").profile.aim == 0.0
    elsewhere = maker(name)(replace(V6, approach=1.5)).profile.aim
    assert elsewhere == pytest.approx(-0.01 * np.mean(TRIMS.get(name, (0.0,))))


def test_an_unknown_controller_is_refused() -> None:
    with pytest.raises(ParameterError, match="no controller 'smrc_m2'; controllers: smarc_m0, "):
        controller("smrc_m2", 0)
