"""What the metro trains share: resistance, gradients, the traction limit, and standstill."""

from typing import Any

import casadi as ca

from ..base.railway import GRAVITY_PER_MILLE, KILOMETRES_PER_HOUR
from .gradients import declare_gradients
from .plant import Plant
from .rolling import BREAKAWAY


def resistance(plant: Plant, position: Any, speed: Any, *, gradients: int) -> Any:
    """Declare running resistance and gradients; return the deceleration (m/s²) by both.

    r = (A + B V + C V² + i) · 9.81/1000 with V in km/h and the gradient i in ‰ (precise braking
    paper, eq. 3, read in N/kN). The line has up to `gradients` stretches: stretch k begins at
    `gradient_position[k]` with the slope `gradient[k]`; before the first the first one holds. A
    train of `length` takes each change in as it moves onto it: i is the mean over the train. The
    paper gives no coefficients; they and all about gradients are our choice.
    """
    a, b, c = (
        plant.parameter(
            f"davis_{letter}", start, unit=unit, minimum=0.0, nominal=start,
            description=f"running resistance in N/kN per (km/h)^{power}; our choice",
        )
        for letter, start, unit, power in (
            ("a", 2.031, "1", 0), ("b", 0.0622, "1", 1), ("c", 0.001807, "1", 2),
        )
    )  # fmt: skip
    length = plant.parameter(
        "length", 118.0, unit="m", minimum=1.0, nominal=100.0,
        description="length of the train, behind its position; our choice: six cars of type B",
    )  # fmt: skip
    begins, change = declare_gradients(plant, gradients)
    slope = change[0]
    if gradients > 1:
        share = ca.fmin(ca.fmax((position - begins[1:]) / length, 0.0), 1.0)
        slope = slope + ca.dot(change[1:], share)
    v = KILOMETRES_PER_HOUR * speed
    return (a + b * v + c * v * v + slope) * GRAVITY_PER_MILLE


def commanded_mass(plant: Plant) -> tuple[Any, Any]:
    """Declare the mass (kg) and its ratio to what the brake control reckons with; return both."""
    mass = plant.parameter(
        "mass", 240e3, unit="kg", minimum=1e3, nominal=1e5,
        description="mass of the loaded train; limits traction and makes energy; our choice",
    )  # fmt: skip
    ratio = plant.parameter(
        "mass_ratio", 1.0, unit="1", minimum=0.1,
        description="true mass over the mass that load weighing reports; our choice",
    )  # fmt: skip
    return mass, ratio


def traction_limit(plant: Plant, speed: Any, mass: Any) -> Any:
    """Declare the traction's limits, and return the largest acceleration (m/s²) by it.

    Limited by force, then by power: F = min(F_max, P_max/v). Our choice of form and numbers.
    """
    force = plant.parameter(
        "traction_force", 280e3, unit="N", minimum=0.0, nominal=1e5,
        description="largest traction force; our choice",
    )  # fmt: skip
    power = plant.parameter(
        "traction_power", 2.8e6, unit="W", minimum=0.0, nominal=1e6,
        description="largest traction power at the wheel; our choice",
    )  # fmt: skip
    return ca.fmin(force, power / ca.fmax(speed, 0.1)) / mass


def stand(plant: Plant, speed: Any, *, traction: Any, net: Any) -> Any:
    """Give the train its equation of motion and its standstill; return the mode.

    It moves forwards only. Where its speed comes down to zero it stops, an event, and a holding
    brake keeps it at exactly 0 m/s until both the `traction` and the `net` acceleration (m/s²,
    resistance deducted) are positive.
    """
    standstill = plant.mode(
        "standstill", start=1, minimum=0, maximum=1, output=True,
        description="1 at standstill, else 0; set by events",
    )  # fmt: skip
    acceleration = ca.if_else(standstill == 1, 0.0, net)
    plant.der(speed, acceleration)
    plant.output("acceleration", acceleration, unit="m/s2", description="rate of the speed")
    plant.event(
        "start_in_motion", speed, direction="rising", when=standstill == 1,
        changes={standstill: 0}, description="only at the start of a run",
    )  # fmt: skip
    plant.event(
        "stop", speed, direction="falling", when=standstill == 0,
        changes={speed: 0.0, standstill: 1}, description="the speed has come down to zero",
    )  # fmt: skip
    plant.event(
        "depart", ca.fmin(traction, net) - BREAKAWAY, direction="rising", when=standstill == 1,
        changes={standstill: 0},
        description="traction exceeds what holds the train, by 1e-8 m/s2",
    )  # fmt: skip
    return standstill
