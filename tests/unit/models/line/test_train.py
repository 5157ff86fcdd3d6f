"""Trains: their limits, their running resistance in several units, and what is refused."""

import math
from dataclasses import replace

import pytest

from railcosim.base.errors import ParameterError
from railcosim.models.line import Davis, Train

TRAIN = Train(
    name="sample",
    mass=50e3,
    mass_empty=40e3,
    mass_loaded=50e3,
    mass_crush=60e3,
    length=40.0,
    davis=Davis(a=2.0, b=0.05, c=0.002),
    max_traction_force=60e3,
    max_power=600e3,
    max_speed=20.0,
    service_deceleration=1.0,
    emergency_deceleration=1.3,
)


def test_resistance_is_in_per_mille_of_the_weight_with_the_speed_in_kmh():
    assert TRAIN.davis.at(10.0) == pytest.approx(2.0 + 0.05 * 36 + 0.002 * 36**2)
    assert TRAIN.davis.force(0.0, 50e3) == pytest.approx(2e-3 * 50e3 * 9.80665)


@pytest.mark.parametrize("speed", [0.0, 3.0, 22.0])
def test_coefficients_convert_from_force_and_from_acceleration(speed: float):
    force = 900.0 + 12.0 * speed + 3.5 * speed**2
    davis = Davis.from_force(900.0, 12.0, 3.5, mass=40e3)
    assert davis.force(speed, 40e3) == pytest.approx(force, rel=1e-12)
    slowing = Davis.from_acceleration(0.02, 1e-4, 2e-5)
    expected = 40e3 * (0.02 + 1e-4 * speed + 2e-5 * speed**2)
    assert slowing.force(speed, 40e3) == pytest.approx(expected, rel=1e-12)


def test_traction_is_limited_by_force_then_by_power():
    assert TRAIN.traction_force(0.0) == 60e3
    assert TRAIN.traction_force(10.0) == pytest.approx(60e3)
    assert TRAIN.traction_force(20.0) == pytest.approx(30e3)


def test_a_traction_curve_limits_further():
    train = replace(TRAIN, traction_curve=((0.0, 60e3), (10.0, 40e3), (20.0, 25e3)))
    assert train.traction_force(5.0) == pytest.approx(50e3)
    assert train.traction_force(20.0) == pytest.approx(25e3)


def test_loads_have_their_usual_names():
    assert [TRAIN.mass_at(load) for load in ("AW0", "AW2", "AW3")] == [40e3, 50e3, 60e3]
    with pytest.raises(ParameterError, match="no load 'AW1'; loads: AW0, AW2, AW3"):
        TRAIN.mass_at("AW1")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass": 0.0}, "mass must be positive and finite"),
        ({"max_power": math.nan}, "max_power must be positive and finite, not nan"),
        ({"mass": 70e3}, "the masses must rise"),
        ({"mass_loaded": 61e3}, "the masses must rise"),
        ({"rotating_mass_factor": 0.9}, "rotating_mass_factor is at least 1"),
        ({"emergency_deceleration": 0.5}, r"emergency brake \(0.5 m/s²\) is weaker"),
        ({"traction_curve": ((1.0, 5.0), (1.0, 4.0))}, "traction curve's speeds must rise"),
    ],
)
def test_a_train_that_cannot_be_is_refused(changes: dict, message: str):
    with pytest.raises(ParameterError, match=f"train 'sample': .*{message}"):
        replace(TRAIN, **changes)


def test_negative_resistance_is_refused():
    with pytest.raises(ParameterError, match="Davis: b must not be negative, but is -1"):
        Davis(a=1.0, b=-1.0, c=0.0)
