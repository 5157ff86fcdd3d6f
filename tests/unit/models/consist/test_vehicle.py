"""Vehicles: their curves, and what cannot be."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.models.consist import Envelope, RunningResistance, ShoeBrake, Vehicle, c80, hxd1

FREE = RunningResistance(constant=0.0, linear=0.0, quadratic=0.0, starting=0.0)
FORCE = Envelope(points=((0.0, 100e3), (20.0, 50e3)))


def vehicle(**given: Any) -> Vehicle:
    return Vehicle(**{"name": "V", "mass": 50e3, "length": 12.0, "resistance": FREE, **given})


@pytest.mark.parametrize("speed", [1.0, 5.0, 40.0, 64.0, 66.0, 80.0, 120.0])
def test_traction_and_electric_brake_of_an_hxd1_follow_the_published_lines(speed: float):
    hyperbola = 34560.0 / speed
    engine, v = hxd1(axle_load=25), speed / 3.6
    assert engine.traction and engine.electric_brake
    line = 760.0 if speed <= 5.0 else 779.0 - 3.8 * speed
    assert engine.traction.at(v) == pytest.approx(1e3 * min(line, hyperbola), rel=1e-12)
    engine = hxd1(axle_load=23)
    line = min(700.0, 715.8 - 3.169 * speed)
    assert engine.traction and engine.electric_brake
    if speed <= 75.0:
        assert engine.traction.at(v) == pytest.approx(1e3 * min(line, hyperbola), rel=1e-12)
    else:
        assert engine.traction.at(v) == pytest.approx(1e3 * hyperbola, rel=1e-12)
    fading = min(max((speed - 2.0) / 8.0, 0.0), 1.0)
    expected = min(461e3 * fading, 1e3 * hyperbola)
    assert engine.electric_brake.at(-v) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("axle_load", [23, 25])
def test_the_force_of_an_hxd1_has_no_step(axle_load: int):
    engine = hxd1(axle_load=axle_load)
    assert engine.traction and engine.electric_brake
    speeds = np.arange(0.0, 130.0, 0.02) / 3.6
    for envelope, steepest in ((engine.traction, 15e3), (engine.electric_brake, 461e3 / 8.0)):
        forces = np.array([envelope.at(speed) for speed in speeds])
        assert np.abs(np.diff(forces)).max() <= 0.02 * steepest * (1 + 1e-6)
        assert (forces * speeds).max() <= 9.6e6 * (1 + 1e-12)


def test_masses_are_the_axle_loads_on_eight_axles():
    assert hxd1(axle_load=25).mass == 8 * 25e3
    assert hxd1(axle_load=23).mass == 8 * 23e3
    assert (c80().mass, c80(loaded=False).mass) == (100e3, 20e3)
    assert hxd1().is_locomotive and not c80().is_locomotive
    with pytest.raises(ParameterError, match="an axle load of 25 or 23 t, not 27"):
        hxd1(axle_load=27)


def test_resistance_is_the_starting_one_then_goes_over_to_the_formula():
    resistance = c80().resistance
    assert resistance.at(0.0) == resistance.at(2.5 / 3.6) == 3.5
    for velocity in (5.0, 40.0, -80.0):
        formula = 0.92 + 0.0048 * abs(velocity) + 0.000125 * velocity**2
        assert resistance.at(velocity / 3.6) == pytest.approx(formula, rel=1e-12)
    middle = 0.92 + 0.0048 * 3.75 + 0.000125 * 3.75**2
    assert resistance.at(3.75 / 3.6) == pytest.approx((3.5 + middle) / 2, rel=1e-12)
    assert resistance.at(2.500001 / 3.6) == pytest.approx(3.5, rel=1e-5)


def test_cylinder_pressure_is_the_coefficient_of_the_reduction():
    brake = ShoeBrake()
    assert brake.pressure_at(100.0) == pytest.approx(0.60 * 420e3)
    assert brake.pressure_at(25.0) == pytest.approx(0.085 * 420e3)
    assert brake.pressure_at(0.0) == 0.0
    assert brake.pressure_at(500.0) == pytest.approx(0.96 * 420e3)


def test_curves_given_as_lists_become_tuples_so_that_vehicles_can_be_compared():
    given = Envelope(points=[[0, 100e3], [20, 50e3]])  # pyright: ignore[reportArgumentType]
    assert given == FORCE and hash(given) == hash(FORCE)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: vehicle(mass=-1.0), r"vehicle 'V': mass: -0.001 t is not within 2 to 1000 t"),
        (lambda: vehicle(mass=100.0), r"mass: 0.1 t is not within"),
        (lambda: vehicle(mass=100e6), r"mass: 100000 t is not within"),
        (lambda: vehicle(mass=float("nan")), r"mass: a finite number is needed, not nan"),
        (lambda: vehicle(mass=10**400), r"mass: a finite number is needed, not inf"),
        (lambda: vehicle(mass=True), r"mass: a number is needed, not True"),
        (lambda: vehicle(mass="80"), r"mass: a number is needed, not '80'"),
        (lambda: vehicle(length=2.9), r"length: 2.9 m is not within 3 to 100 m"),
        (lambda: vehicle(length=101), r"length: 101 m is not within"),
        (lambda: vehicle(name=" "), r"vehicle: name: a name is needed"),
        (lambda: vehicle(resistance=1.0), r"RunningResistance is needed, not 1.0"),
        (lambda: vehicle(traction=3.0), r"traction: Envelope or None is needed, not 3.0"),
        (lambda: vehicle(traction=Envelope(points=((0.0, 1e5), (1.0, 1.1e5)))),
         r"traction.points\[1\]\[1\]: 110 kN is more than the 100 kN at the lower speed"),
        (lambda: vehicle(electric_brake=Envelope(points=((0.0, 1e5), (1.0, 1.1e5)))),
         r"electric_brake.points\[1\]\[1\]: .* it may rise only at the beginning, from 0 kN"),
        (lambda: vehicle(electric_brake=Envelope(
            points=((0.0, 0.0), (1.0, 2e5), (2.0, 1e5), (3.0, 2e5)))),
         r"electric_brake.points\[3\]\[1\]: 200 kN is more than the 100 kN"),
        (lambda: Envelope(points=((0.0, 1e5),)), r"points: a curve needs two points or more"),
        (lambda: Envelope(points=((0.0, 1e5), (0.0, 5e4))),
         r"points\[1\]\[0\]: 0 km/h does not lie above the 0 km/h before it"),
        (lambda: Envelope(points=((0.0, 1e5), (300.0, 5e4))), r"1080 km/h is not within 0 to 720"),
        (lambda: Envelope(points=((0.0, 760.0), (9.0, 500.0))), r"below 1 kN: are they in the ri"),
        (lambda: Envelope(points=((0.0, 760e6), (9.0, 5e3))), r"760000 kN is not within"),
        (lambda: Envelope(points=((0.0, 1e5), (9.0, 1e4)), power=0.0), r"power: 0 kW is not with"),
        (lambda: Envelope(points=((0.0, 1e5), (9.0, 1e4, 3.0))),  # pyright: ignore
         r"points\[1\]: a pair is needed, not 3 numbers"),
        (lambda: Envelope(points=7), r"points: a list is needed, not 7"),  # pyright: ignore
        (lambda: RunningResistance(constant=-1.0, linear=0.0, quadratic=0.0, starting=0.0),
         r"running resistance: constant: -1 N/kN is not within 0 to 100"),
        (lambda: ShoeBrake(service=((0.0, 0.0), (50.0, 1.2))), r"1.2 is not within 0 to 1"),
        (lambda: ShoeBrake(service=((10.0, 0.0), (50.0, 0.2))), r"the first pair must be 0 kPa"),
        (lambda: ShoeBrake(service=((0.0, 0.0), (50.0, 0.2), (60.0, 0.1))),
         r"service\[2\]\[1\]: the coefficient falls to 0.1"),
        (lambda: ShoeBrake(service=((0.0, 0.0), (50.0, 0.0))), r"the brake would never act"),
        (lambda: ShoeBrake(shoes=8.0), r"shoes: a whole number is needed"),  # pyright: ignore
        (lambda: ShoeBrake(cylinder_diameter=254.0), r"254000 mm is not within"),
        (lambda: ShoeBrake(cylinder_pressure=420.0), r"0.42 kPa is not within 50 to 1000 kPa"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(make: Callable[[], object], message: str):
    with pytest.raises(ParameterError, match=message):
        make()


def test_an_electric_brake_may_rest_at_zero_then_rise():
    rising = Envelope(points=((0.0, 0.0), (0.5, 0.0), (3.0, 1e5), (9.0, 2e5), (20.0, 2e5)))
    assert vehicle(electric_brake=rising).is_locomotive
