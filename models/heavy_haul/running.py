"""What acts on every vehicle along the way: running resistance and gradients."""

from typing import Any, NamedTuple

import casadi as ca

from ...base.railway import GRAVITY_PER_MILLE, KILOMETRES_PER_HOUR
from ..consist import Consist
from ..gradients import declare_gradients
from ..plant import Plant
from .mapping import mapped

STARTING = (2.5, 5.0)  # km/h: the starting resistance fades into the formula; our choice


class Running(NamedTuple):
    """For every vehicle: mass (kg), length (m), resistance (N, from 0), slope (‰), height (m)."""

    mass: Any
    length: Any
    resistance: Any
    slope: Any
    height: Any


def declare_running(
    plant: Plant, consist: Consist, displacement: Any, speed: Any, *, gradients: int
) -> Running:
    """Declare masses, resistances and the line's gradients.

    w = a + b V + c V² N/kN with V in km/h (heavy-haul paper, eqs. 5 and 6), and from rest the
    paper's constant. The line has up to `gradients` stretches: stretch k begins at
    `gradient_position[k]` with `gradient[k]`; before the first the first one holds. A vehicle takes
    each change in as it moves onto it: its slope is the mean over its length (our choice).
    """
    vehicles, size = consist.vehicles, consist.size
    mass = plant.parameter(
        "vehicle[].mass", [v.mass for v in vehicles], unit="kg", size=size, minimum=1e3,
        nominal=1e5, description="mass of the vehicle",
    )  # fmt: skip
    coefficients = [
        plant.parameter(
            f"vehicle[].resistance_{name}", [getattr(v.resistance, name) for v in vehicles],
            unit=unit, size=size, minimum=0.0,
            description=f"running resistance, {text}; heavy-haul paper",
        )
        for name, unit, text in (
            ("constant", "1", "N/kN"), ("linear", "1", "N/kN per km/h"),
            ("quadratic", "1", "N/kN per (km/h)^2"), ("starting", "1", "N/kN, below 2.5 km/h"),
        )
    ]  # fmt: skip
    length = plant.parameter(
        "vehicle[].length", [v.length for v in vehicles], unit="m", size=size, minimum=1.0,
        nominal=10.0, description="length over couplers; for gradients and the brake wave",
    )  # fmt: skip
    ahead = [sum(v.length for v in vehicles[:i]) for i in range(size)]
    behind = plant.parameter(
        "vehicle[].behind", ahead, unit="m", size=size, minimum=0.0, nominal=100.0,
        description="how far the vehicle's front is behind the train's, unloaded",
    )  # fmt: skip
    location = plant.parameter(
        "location", 0.0, unit="m", nominal=1000.0,
        description="place of the train's front on the line at the start",
    )  # fmt: skip
    position = location + displacement - behind
    plant.output("vehicle[].position", position, unit="m", nominal=1000.0,
                 description="place of the vehicle's front on the line")  # fmt: skip
    plant.output("position", position[0], unit="m", nominal=1000.0,
                 description="place of the train's front on the line")  # fmt: skip
    (resistance,) = mapped(
        "resistance_of_vehicle", _resistance, speed, mass, *coefficients, count=size
    )
    slope, height = _gradients(plant, position, length, gradients)
    return Running(mass, length, resistance, slope, height)


def _resistance(v: Any, mass: Any, a: Any, b: Any, c: Any, starting: Any) -> list[Any]:
    speed = KILOMETRES_PER_HOUR * ca.fabs(v)
    low, high = STARTING
    share = ca.fmin(ca.fmax((speed - low) * (1.0 / (high - low)), 0.0), 1.0)
    running = a + speed * (b + speed * c)
    return [(starting + share * (running - starting)) * GRAVITY_PER_MILLE * mass]


def _gradients(plant: Plant, position: Any, length: Any, count: int) -> tuple[Any, Any]:
    """Declare the line; return slope (‰) and mean height (m over position 0) of each vehicle."""
    begins, change = declare_gradients(plant, count)
    size = position.shape[0]
    if count == 1:
        return ca.repmat(change[0], size, 1), 1e-3 * change[0] * (position - 0.5 * length)

    def equations(front: Any, own: Any, *line: Any) -> list[Any]:
        """Sum over all stretches: the share of the vehicle on it, and how far its middle is."""
        slope = line[0]
        height = line[0] * (front - 0.5 * own)
        for begin, turn in zip(line[1:count], line[count:], strict=True):
            beyond = front - begin
            on = ca.fmin(ca.fmax(beyond / own, 0.0), 1.0)
            slope = slope + turn * on
            height = height + turn * (0.5 * own * on * on + ca.fmax(beyond - own, 0.0))
        return [slope, 1e-3 * height]

    line = [change[0], *ca.vertsplit(begins)[1:], *ca.vertsplit(change)[1:]]
    slope, height = mapped("gradient_of_vehicle", equations, position, length, *line, count=size)
    return slope, height
