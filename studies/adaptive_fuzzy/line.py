"""The line of Fig. 1 and its automatic train protection; all numbers are ours."""

from pathlib import Path

from ...controllers import ATP, BrakingPattern, HoldingBrake, LimitCurve
from ...cosim import Block, Constant, Delay, Diagram, Fmu, Gain, Sum

CRUISE, REGULATED = 10.0, 7.0  # m/s
REGULATION_FROM, MARK = 60.0, 250.0  # m
STOPPING = 0.5  # m/s², of the stopping curve
OVERLAP = 45.0  # m, from the mark to the danger point

EMERGENCY_FORCE = 16e3  # N for each motor: 1 m/s² at the nominal mass
HOLDING_FORCE = 16e3  # N
GUARANTEED = 0.8  # m/s², that the emergency brake gives at any mass and adhesion considered
ACCELERATION = 1.5  # m/s², that traction does not exceed at any mass considered

LIMITS = LimitCurve(
    maximum=14.0, restrictions=((150.0, 400.0, 11.0),), stops=(MARK + OVERLAP,), braking=GUARANTEED
)


def protection(period: float) -> ATP:
    """Return the ATP of the line, for an emergency brake that acts within 1.4 s."""
    return ATP(
        curve=LIMITS,
        acceleration=ACCELERATION,
        emergency_time=1.5,
        service_time=1.8,
        warning_time=2.1,
        service_command=-5.0,
        emergency_command=0.0,
        period=period,
    )


def line(
    name: str, controller: Block, fmu: Path, *, step: float, protected: bool = True
) -> Diagram:
    """Return a train that runs the pattern of Fig. 1 from 10 m/s, under ATP or merely watched.

    An emergency opens the line breaker and applies the friction brake, both after the `link`'s
    delay. Unprotected, the ATP still sees and tells, but nothing obeys it.
    """
    loop = Diagram(name, step=step)
    loop.add(
        "pattern",
        BrakingPattern(
            cruise=CRUISE,
            regulated=REGULATED,
            regulation_from=REGULATION_FROM,
            stop=MARK,
            braking=STOPPING,
            period=step,
        ),
    )
    loop.add("controller", controller)
    loop.add("atp", protection(step))
    loop.add("release", Constant(0.0, unit="1"))
    loop.add("link", Delay(0.5, interpolation="hold"))
    loop.add("force", Gain(EMERGENCY_FORCE, input_unit="1", unit="N"))
    loop.add("holding", HoldingBrake(force=HOLDING_FORCE, period=step))
    loop.add("brake", Sum("++"))
    loop.add("train", Fmu(fmu, speed=CRUISE))
    for source, target in (
        ("train.position", "pattern.position"),
        ("train.position", "atp.position"),
        ("train.speed", "atp.speed"),
        ("train.speed", "controller.measurement"),
        ("train.speed", "holding.speed"),
        ("pattern.target", "controller.reference"),
        ("pattern.target", "holding.target"),
        ("controller.u", "atp.demand"),
        ("release.y", "atp.release"),
        ("atp.emergency" if protected else "release.y", "link.u"),
        ("link.y", "force.u"),
        ("link.y", "train.trip"),
        ("force.y", "brake.u1"),
        ("holding.brake", "brake.u2"),
        ("brake.y", "train.brake"),
        ("atp.command" if protected else "controller.u", "train.notch"),
    ):
        loop.connect(source, target)
    return loop
