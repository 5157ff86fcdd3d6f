"""The account of energy: what came in, what is stored, what has become heat, what is missing."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import casadi as ca

from ...base.railway import GRAVITY_PER_MILLE
from ..consist import DraftGear, PowerLaw
from ..plant import Plant
from .couplers import Couplers, extension, half_power, loading_curve
from .locomotives import Locomotives
from .mapping import mapped, mapped_by_kind, total
from .running import Running

FALLING = 1e3 * GRAVITY_PER_MILLE  # m/s², the gravity that gradients are counted with
STEPS = 3  # of the fixed point below; its contraction is under 0.1 in a gear's stroke


def mechanical_energy(running: Running, speed: Any) -> tuple[Any, Any]:
    """Return the kinetic and the potential energy (J) of all vehicles."""
    size = speed.shape[0]
    kinetic, potential = mapped(
        "energy_of_vehicle", lambda v, m, h: [0.5 * m * v * v, FALLING * m * h],
        speed, running.mass, running.height, count=size,
    )  # fmt: skip
    return total(kinetic), total(potential)


def declare_energy(
    plant: Plant,
    *,
    couplers: Couplers,
    gear: Any,
    stretch: Any,
    running: Running,
    locomotives: Locomotives,
    shoes: Any,
    speed: Any,
    start: Any,
) -> None:
    """Declare the works as states, and the account as outputs.

    `gear` and `stretch` are the gears' force and stretch at an inner step's end, the other forces
    (N) act in it. The gears' work is taken with the mean of the forces before and after, that of
    the others with the speed before. The residual is what the account does not explain: kinetic +
    potential − start − traction + all that was dissipated or is stored.
    """
    size = speed.shape[0]
    way = ca.fabs(speed)
    relative = speed[:-1] - speed[1:]
    (damped,) = mapped(
        "power_of_damper", lambda c, v: [c * v * v], couplers.damping, relative, count=size - 1
    )
    powers = {
        "traction": (locomotives.traction, "work of the locomotives' traction"),
        "electric_brake": (locomotives.braking, "work taken by the electric brakes"),
        "resistance": (total(running.resistance * way), "work of the running resistance"),
        "air_brake": (total(shoes * way), "work of the brake shoes"),
        "damping": (total(damped), "work of the dampers that are parallel to the gears"),
    }
    works = {}
    for name, (power, text) in powers.items():
        works[name] = plant.state(
            f"energy.{name}", unit="J", nominal=1e7, output=True, description=text
        )
        plant.der(works[name], power)
    taken = plant.memory(
        "coupler[].gear_work", unit="J", size=size - 1, nominal=1e4,
        description="work that the joint's gears have taken",
    )  # fmt: skip
    plant.update(taken, taken + 0.5 * (couplers.gear + gear) * (stretch - couplers.stretch))
    stored, stops = _stored(couplers)
    kinetic, potential = mechanical_energy(running, speed)
    spent = total(taken)
    gears = spent - stored
    dissipated = sum(works[name] for name in powers if name != "traction")
    residual = kinetic + potential - start - works["traction"]
    residual = residual + dissipated + spent + stops
    for name, value, text in (
        ("gears", gears, "work that the gears have turned into heat"),
        ("gears_stored", stored + stops, "energy stored in gears and solid stops"),
        ("kinetic", kinetic, "kinetic energy"),
        ("potential", potential, "potential energy over position 0"),
        ("residual", residual, "what the account does not explain: the error of the integration"),
    ):
        plant.output(f"energy.{name}", value, unit="J", nominal=1e7, description=text)


def _stored(couplers: Couplers) -> tuple[Any, Any]:
    """Return what is stored in all gears, and in the solid stops, in J."""
    slack, stiffness, ratio = couplers.parameters

    def equations(gear: DraftGear) -> Any:
        def of(d: Any, force: Any, free: Any, k: Any, part: Any) -> list[Any]:
            way, pull = ca.fabs(d), ca.fabs(force)
            stop = ca.fmax(way - 0.5 * free - gear.stroke, 0.0)
            return [
                _recoverable(gear, way, pull, free, k, part),
                0.5 * gear.stop_stiffness * stop * stop,
            ]

        return of

    gears = [joint.gear for joint in couplers.consist.couplers]
    stored, stops = mapped_by_kind(
        "stored_in_coupler", equations, gears, couplers.stretch, couplers.gear, slack, stiffness,
        ratio,
    )  # fmt: skip
    return total(stored), total(stops)


def _recoverable(gear: DraftGear, d: Any, force: Any, free: Any, k: Any, ratio: Any) -> Any:
    """Return what a gear gives back: down the slope k to the unloading curve, then along it.

    The slope meets the curve at d', where F − k (d − d') = lo(d').
    """
    at, give = d, 1.0 / k
    stroke = extension(gear, at, free)[1]
    for _ in range(STEPS):
        at = d - (force - ratio * loading_curve(gear, stroke)) * give
        stroke = ca.fmin(ca.fmax(at - 0.5 * free, 0.0), gear.stroke)
    # Along the slope, not to the curve: then an error of d' counts by its square only.
    return (force - 0.5 * k * (d - at)) * (d - at) + ratio * _loading_work(gear, stroke)


def _loading_work(gear: DraftGear, stroke: Any) -> Any:
    """Return the work (J) of loading a gear to a stroke (m): the integral of its curve."""
    law = gear.loading
    if not isinstance(law, PowerLaw):
        return _points_work(law.points, stroke)
    slope = law.initial_force / law.initial_stroke
    begun = ca.fmin(stroke, law.initial_stroke)
    first = 0.5 * slope * begun * begun + law.initial_force * (stroke - begun)
    scale = law.final_force / gear.stroke**law.exponent / (law.exponent + 1.0)
    return first + scale * stroke * stroke * half_power(stroke, law.exponent - 1.0)


def _points_work(points: Sequence[tuple[float, float]], stroke: Any) -> Any:
    work, slope = 0.0, 0.0
    for (a, f), (b, g) in pairwise(points):
        change = (g - f) / (b - a) - slope
        slope += change
        over = ca.fmax(stroke - a, 0.0)
        work = work + 0.5 * change * over * over
    return work
