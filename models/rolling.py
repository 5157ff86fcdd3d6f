"""What trains on a line share: position and speed, standstill, and the friction brake."""

from typing import Any, NamedTuple

import casadi as ca

from .plant import Plant

GRAVITY = 9.80665  # m/s², standard gravity
# By how much (m/s²) a drive must exceed the friction to move what stands. It keeps the departure
# clear of the time's resolution, at which the train would stop again; it costs 1e-16/(2 r) m/s
# where the drive rises at r m/s³.
BREAKAWAY = 1e-8


class Motion(NamedTuple):
    """A train's motion: its two states and its two modes."""

    position: Any
    speed: Any
    direction: Any
    standstill: Any


def motion(plant: Plant, *, position: float = 0.0, speed: float = 0.0) -> Motion:
    """Declare a train's position (m), speed (m/s), direction and standstill with their starts.

    A run may start in motion: the direction then follows from the speed, before the first step.
    """
    return Motion(
        plant.state(
            "position", unit="m", start=position, nominal=10.0, output=True,
            description="place on the line",
        ),
        plant.state(
            "speed", unit="m/s", start=speed, nominal=10.0, output=True, description="train speed"
        ),
        plant.mode(
            "direction", minimum=-1, maximum=1, output=True,
            description="1 forwards, -1 backwards, 0 at standstill; set by events",
        ),
        plant.mode(
            "standstill", start=1, minimum=0, maximum=1, output=True,
            description="1 at standstill, else 0; set by events",
        ),
    )  # fmt: skip


def roll(plant: Plant, train: Motion, drive: Any, friction: Any) -> None:
    """Give a train its equation of motion, its acceleration as an output, and its events.

    `drive` (m/s²) is signed: what traction gives. `friction` (m/s², not negative) opposes motion;
    at standstill it holds, as far as it is needed, so a train stands with a speed of exactly 0
    until the drive exceeds the friction (by `BREAKAWAY`). Without friction a train passes through
    speed zero as its equations say: it stops and departs in the same instant. Dry friction, our
    choice.
    """
    position, speed, direction, standstill = train
    acceleration = ca.if_else(standstill == 1, 0.0, drive - direction * friction)
    plant.der(position, speed)
    plant.der(speed, acceleration)
    plant.output(
        "acceleration", acceleration, unit="m/s2", description="rate of change of the speed"
    )
    standing = standstill == 1
    plant.event(
        "stop", direction * speed, direction="falling", when=standstill == 0,
        changes={speed: 0.0, direction: 0, standstill: 1},
        description="the speed has come down to zero",
    )  # fmt: skip
    plant.event(
        "start_in_motion", ca.fabs(speed), direction="rising", when=standing,
        changes={direction: ca.if_else(speed > 0.0, 1, -1), standstill: 0},
        description="only at the start of a run",
    )  # fmt: skip
    plant.event(
        "depart", ca.fabs(drive) - friction - BREAKAWAY, direction="rising", when=standing,
        changes={direction: ca.if_else(drive > 0.0, 1, -1), standstill: 0},
        description="the drive exceeds the friction, by 1e-8 m/s2",
    )  # fmt: skip


def lag(plant: Plant, name: str, start: float, description: str) -> Any:
    """Declare the time constant (s) of a first-order lag; below 0.02 s an FMU refuses it.

    An inner step of 2 ms would no longer follow it well: RK4's error is 3e-7 of the change with
    ten steps in a time constant, 3e-11 with a hundred.
    """
    return plant.parameter(name, start, unit="s", minimum=0.02, description=description)


def adhesion_limit(plant: Plant) -> Any:
    """Declare the adhesion, and return the largest acceleration that it bears, in m/s².

    That holds for the train with its rotating masses: they are braked and driven by their own
    shafts, and not through the rail.
    """
    adhesion = plant.parameter(
        "adhesion", 0.15, unit="1", minimum=0.0, tunable=True,
        description="coefficient of adhesion between wheel and rail; our choice",
    )  # fmt: skip
    return plant.dependent(
        "adhesion_limit", adhesion * GRAVITY, unit="m/s2",
        description="largest acceleration that adhesion bears: adhesion times standard gravity",
    )  # fmt: skip


def friction_brake(plant: Plant, mass: Any) -> Any:
    """Declare a friction brake for an accelerated mass (kg); return its deceleration in m/s².

    The force follows what is demanded (input `brake`, N) with a first-order lag. The wheel-slide
    protection keeps the demand within the adhesion; should the adhesion fall during braking, the
    rail bears only that much at once. All our choice.
    """
    brake = plant.input(
        "brake", unit="N", minimum=0.0, maximum=32e3, nominal=1e4,
        description="friction brake force demanded; below 0 it counts as 0",
    )  # fmt: skip
    time_constant = lag(plant, "brake_lag", 0.4, "time constant of the friction brake; our choice")
    limit = adhesion_limit(plant)
    force = plant.state(
        "brake_force", unit="N", minimum=0.0, nominal=1e4, output=True,
        description="friction brake force",
    )  # fmt: skip
    demanded = ca.fmin(ca.fmax(brake, 0.0), limit * mass)
    plant.der(force, (demanded - force) / time_constant)
    return ca.fmin(force / mass, limit)
