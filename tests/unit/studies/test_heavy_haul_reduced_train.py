"""Consists reduced to what a plan needs."""

from dataclasses import replace
from typing import Any

import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers.train_handling import Journey, optimal_handling
from railcosim.models.consist import Consist, EndOfTrain, Vehicle, c80, coal_train, hxd1
from railcosim.studies.heavy_haul.reduced_train import reduced_train
from railcosim.studies.heavy_haul.rolling import LENGTH, rolling_section


def test_the_papers_train() -> None:
    consist = coal_train()
    train = reduced_train(consist)
    assert (train.mass, train.length) == (consist.mass, pytest.approx(consist.length))
    assert train.shares[:3] == (0.5, 0.5, 0.0)
    for v in (1.0, 10.0, 17.0, 22.0):
        pull, hold = consist.vehicles[0].traction, consist.vehicles[0].electric_brake
        assert pull and hold
        assert float(train.traction.at(v)) == pytest.approx(2.0 * pull.at(v))
        assert float(train.electric_brake.at(v)) == pytest.approx(2.0 * hold.at(v))


def test_the_pipes_delay_is_its_mean_over_the_wagons() -> None:
    consist = coal_train(locomotives=1, wagons=3)
    brake = reduced_train(consist).brake
    assert brake is not None
    far = 35.222 + 12.0 * (1 + 2 + 3) / 3  # m, to the end of each wagon
    assert brake.application_time == pytest.approx(4.0 + far / 250.0)
    assert brake.release_time == pytest.approx(8.0 + far / 160.0)


def test_the_wave_from_the_rear_halves_the_way() -> None:
    consist = coal_train(end_of_train=EndOfTrain(radio_delay=0.0))
    front, both = reduced_train(coal_train()).brake, reduced_train(consist).brake
    assert front and both
    assert both.application_time - 4.0 < 0.6 * (front.application_time - 4.0)
    assert both.release_time == front.release_time


def with_vehicles(*vehicles: Vehicle) -> Consist:
    whole = coal_train(wagons=len(vehicles))
    return Consist(name="mixed", vehicles=vehicles, couplers=whole.couplers[: len(vehicles) - 1])


def test_locomotives_that_differ_are_refused() -> None:
    wagons = (c80(), c80())
    old = replace(hxd1(), name="old", electric_brake=None)
    with pytest.raises(
        ParameterError,
        match=r"consist 'mixed': only .* locomotives alike .* 'HXD1' and 'old' \(vehicles 0 and 2, "
        r"from 0\) differ in electric_brake, which the latter has not; make them alike, or",
    ):
        reduced_train(with_vehicles(hxd1(), c80(), old, *wagons))
    with pytest.raises(ParameterError, match=r"\(vehicles 0 and 1, .* traction \(points\); make"):
        reduced_train(with_vehicles(hxd1(), hxd1(axle_load=23), *wagons))


def test_wagons_whose_brakes_differ_are_planned_for_without_the_air_brake() -> None:
    alike = with_vehicles(hxd1(), *(c80(),) * 6)
    mixed = with_vehicles(hxd1(), *(c80(),) * 5, replace(c80(loaded=False), mass=100e3))
    section = replace(rolling_section(), length=1000.0, gradients=((0.0, 0.0),))
    journey = Journey(section=section, start_speed=15.0, end_speed=15.0, time=66.0)
    train = reduced_train(mixed)
    assert (train.brake, train.braked) == (None, reduced_train(alike).braked)
    assert optimal_handling(train, journey).running_time == pytest.approx(66.0, abs=1e-3)
    with pytest.raises(
        ParameterError,
        match=r"no air brake to plan with: 'C80' and 'C80 empty' \(vehicles 1 and 6, from 0\) "
        r"differ in brake \(cylinder_pressure\); plan without air_brake, or",
    ):
        optimal_handling(train, journey, air_brake=True)


@pytest.mark.parametrize("wrong", ["f.yaml", None, coal_train])
def test_what_is_no_consist_is_refused(wrong: Any) -> None:
    with pytest.raises(
        ParameterError, match="reduced_train: consist must be a Consist, not .*; re"
    ):
        reduced_train(wrong)


def test_the_rolling_line_is_as_long_as_it_says() -> None:
    section = rolling_section()
    assert section.length == LENGTH
    assert section.elevation(section.length) == pytest.approx(0.0)
