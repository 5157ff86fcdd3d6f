"""Consists reduced to what a plan needs."""

import pytest

from railcosim.base.errors import ParameterError
from railcosim.models.consist import Consist, EndOfTrain, Vehicle, coal_train
from railcosim.studies.heavy_haul.reduction import reduced_train
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


def test_locomotives_that_differ_are_refused() -> None:
    consist = coal_train(wagons=3)
    first = consist.vehicles[0]
    other = Vehicle(
        name="other", mass=1e5, length=20.0, resistance=first.resistance, traction=first.traction
    )
    mixed = Consist(
        name="mixed", vehicles=(first, other, *consist.vehicles[2:]), couplers=consist.couplers
    )
    with pytest.raises(ParameterError, match="consist 'mixed': can be reduced only if"):
        reduced_train(mixed)


def test_the_rolling_line_is_as_long_as_it_says() -> None:
    section = rolling_section()
    assert section.length == LENGTH
    assert section.elevation(section.length) == pytest.approx(0.0)
