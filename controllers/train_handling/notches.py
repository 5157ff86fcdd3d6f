"""A handling by notches, as a lever has them."""

import math

import numpy as np

from ...base.errors import ParameterError
from .checks import require_kind, require_numbers
from .handling import Handling
from .rigid import RigidTrain

FINE = 5.0  # m between the places of a handling by notches
SLOW = 1.0  # m/s, under which a handling is not followed
KEEP = 0.75  # notches by which the wanted force may be off before another notch is taken


def lever(wanted: float, notch: float, level: float) -> float:
    """Return the lever's place, in notches: as it is, or the nearest one if it is too far off."""
    return float(round(wanted / notch)) if abs(wanted / notch - level) > KEEP else level


def notched(
    handling: Handling,
    rigid: RigidTrain,
    *,
    notch: float,
    gain: float = 200e3,
    rate: float = 50e3,
) -> Handling:
    """Return a handling whose force is a multiple of `notch` (N) except while it changes.

    The wanted force is the planned one + `gain` (N per m/s) · (planned speed − speed), by which
    speed and time stay near the plan's; the lever goes to the nearest notch within the envelopes
    when it is off by more than 0.75 of one. The force changes by `rate` (N/s). The speed is
    integrated anew with the reduced model, places 5 m apart; the air brake is the plan's at the
    place. It is what `HandlingDriver` does, told beforehand. All our choice. Raise ParameterError
    for numbers that are not positive, and for a train that would halt.
    """
    require_kind("notched", "handling", handling, Handling, "optimal_handling gives one")
    require_kind("notched", "rigid", rigid, RigidTrain, "write RigidTrain(train=…, section=…)")
    require_numbers("notched", notch=notch, gain=gain, rate=rate)
    if min(notch, gain, rate) <= 0.0:
        raise ParameterError(
            f"notched: notch, gain and rate must be positive, not {notch!r}, {gain!r}, {rate!r}"
        )
    first, last = handling.position[0], handling.position[-1]
    position = np.linspace(first, last, math.ceil((last - first) / FINE) + 1)
    plan, target, reduction, cylinder = (
        np.interp(position, handling.position, values)
        for values in (handling.force, handling.speed, handling.reduction, handling.cylinder)
    )
    load, _ = rigid.gradient_loads(position)
    step = position[1] - position[0]
    force, speed = np.zeros((2, len(position)))
    force[0], speed[0] = plan[0], handling.speed[0]
    level = 0.0
    for k in range(len(position) - 1):
        v = float(speed[k])
        level = lever(plan[k] + gain * (target[k] - v), notch, level)
        level = _within(rigid, level, notch, v)
        most = rate * step / v
        force[k + 1] = force[k] + min(max(notch * level - force[k], -most), most)
        mean = (force[k] + force[k + 1]) / 2.0
        a = rigid.acceleration((load[k] + load[k + 1]) / 2.0, v, mean, cylinder[k])
        squared = v * v + 2.0 * step * float(a)
        if not squared > SLOW**2:
            raise ParameterError(
                f"notched: at {position[k]:.0f} m the train would halt; notches of "
                f"{1e-3 * notch:g} kN are too coarse for this plan"
            )
        speed[k + 1] = math.sqrt(squared)
    return Handling(
        position=position,
        speed=speed,
        force=force,
        reduction=reduction,
        cylinder=cylinder,
        coupler=rigid.coupler_forces(position, speed, force, cylinder),
        notch=notch,
    )


def _within(rigid: RigidTrain, level: float, notch: float, speed: float) -> float:
    """Return the notch nearest to a level within the envelopes at a speed."""
    most = math.floor(float(rigid.train.traction.at(speed)) / notch)
    least = -math.floor(float(rigid.train.electric_brake.at(speed)) / notch)
    return float(min(max(level, least), most))
