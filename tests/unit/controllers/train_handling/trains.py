"""Small trains and lines for the tests of handlings."""

from railcosim.controllers.train_handling import ForceCurve, ReducedBrake, ReducedTrain
from railcosim.models.line import Section

WAGONS = 12
BRAKE = ReducedBrake(
    full_pressure=420.0, area=0.0479, shoes=8.0,
    service=((0.0, 0.0), (50.0, 0.17), (100.0, 0.6), (170.0, 0.96)),
    application_time=5.0, release_time=10.0,
)  # fmt: skip
TRAIN = ReducedTrain(
    masses=(200e3, *(100e3,) * WAGONS),
    lengths=(35.0, *(12.0,) * WAGONS),
    resistances=((1.4, 0.0038, 0.0003), *((0.92, 0.0048, 0.000125),) * WAGONS),
    shares=(1.0, *(0.0,) * WAGONS),
    traction=ForceCurve(points=((0.0, 300e3), (20.0, 200e3)), power=3e6),
    electric_brake=ForceCurve(points=((0.0, 0.0), (3.0, 200e3)), power=2.5e6),
    braked=(False, *(True,) * WAGONS),
    brake=BRAKE,
)
WAVES = Section(
    name="waves",
    length=2000.0,
    gradients=(
        (0.0, 0.0), (300.0, 6.0), (550.0, -6.0), (800.0, 6.0), (1100.0, -6.0), (1400.0, 0.0),
    ),
    speed_limits=((0.0, 22.0), (1200.0, 16.0), (1700.0, 22.0)),
)  # fmt: skip
DESCENT = Section(
    name="descent",
    length=4000.0,
    gradients=((0.0, 0.0), (500.0, -20.0), (3500.0, 0.0)),
    speed_limits=((0.0, 16.0),),
)
