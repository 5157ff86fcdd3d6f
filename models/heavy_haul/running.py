"""What acts on every vehicle along the way: running resistance and gradients."""

from typing import Any, NamedTuple

import casadi as ca

from ...base.railway import GRAVITY_PER_MILLE, KILOMETRES_PER_HOUR
from ..consist import Consist
from ..plant import Plant
from .mapping import mapped

STARTING = (2.5, 5.0)  # km/h: the starting resistance fades into the formula; our choice


class Running(NamedTuple):
    """For every vehicle: its mass (kg), resistance (N, not negative), slope (‰), height (m)."""

    mass: Any
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
    return Running(mass, resistance, slope, height)


def _resistance(v: Any, mass: Any, a: Any, b: Any, c: Any, starting: Any) -> list[Any]:
    speed = KILOMETRES_PER_HOUR * ca.fabs(v)
    low, high = STARTING
    share = ca.fmin(ca.fmax((speed - low) * (1.0 / (high - low)), 0.0), 1.0)
    running = a + speed * (b + speed * c)
    return [(starting + share * (running - starting)) * GRAVITY_PER_MILLE * mass]


def _gradients(plant: Plant, position: Any, length: Any, count: int) -> tuple[Any, Any]:
    """Declare the line; return slope (‰) and mean height (m over position 0) of each vehicle."""
    begins = plant.parameter(
        "gradient_position", 0.0, unit="m", size=count, nominal=1000.0,
        description="where a stretch begins, in rising order",
    )  # fmt: skip
    slopes = plant.parameter(
        "gradient", 0.0, unit="1", size=count, nominal=1.0,
        description="slope of the stretch in per mille, uphill positive; the last is repeated "
        "where the line has fewer stretches",
    )  # fmt: skip
    change = plant.dependent(
        "gradient_change", slopes - ca.vertcat(0.0, *ca.vertsplit(slopes)[:-1]), unit="1",
        description="slope over that of the stretch before, in per mille",
    )  # fmt: skip
    size = position.shape[0]
    if count == 1:
        return ca.repmat(change[0], size, 1), 1e-3 * change[0] * (position - 0.5 * length)
    slope = [change[0]]
    height = [1e-3 * change[0] * (position - 0.5 * length)]
    for k in range(1, count):
        on, up = mapped("share_of_stretch", _share, position, length, begins[k], count=size)
        slope.append(change[k] * on)
        height.append(1e-3 * change[k] * up)
    return _sum(slope), _sum(height)


def _share(position: Any, length: Any, begin: Any) -> list[Any]:
    """Return the share of a vehicle that is beyond a change, and how far its middle is, in m."""
    beyond = position - begin
    on = ca.fmin(ca.fmax(beyond / length, 0.0), 1.0)
    return [on, 0.5 * length * on * on + ca.fmax(beyond - length, 0.0)]


def _sum(terms: list[Any]) -> Any:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total
