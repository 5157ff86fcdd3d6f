"""Draft gears: slack, hysteresis, solid stop and damping of every joint."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, get_args

import casadi as ca

from ...base.errors import ParameterError
from ..consist import Consist, DraftGear, PowerLaw
from ..plant import Plant
from .mapping import greatest, mapped, mapped_by_kind, ramps

Hysteresis = Literal["incremental", "dahl", "switching"]
DAHL_WIDTH = 10e3  # N, so that the Dahl form has a finite rate where both curves meet; our choice
TINY = 1e-300


@dataclass(frozen=True)
class Couplers:
    """The joints as symbols: `force` (N, all of it, tension positive) and what makes it up."""

    consist: Consist
    hysteresis: Hysteresis
    force: Any
    gear: Any  # memory: force of the gears, N
    stretch: Any  # memory: stretch at which they have it, m
    branch: Any  # memory of the Dahl form, −1 (unloading) to 1 (loading); else None
    parameters: tuple[Any, ...]  # slack, stiffness, unloading ratio
    damping: Any


def check_hysteresis(hysteresis: str) -> None:
    """Raise ParameterError for a form that does not exist."""
    forms = get_args(Hysteresis)
    if hysteresis not in forms:
        raise ParameterError(
            f"heavy_haul_train: hysteresis must be one of {', '.join(forms)}, not {hysteresis!r}"
        )


def declare_couplers(
    plant: Plant, consist: Consist, hysteresis: Hysteresis, displacement: Any, speed: Any
) -> Couplers:
    """Declare the joints' parameters and memories; return them with their forces.

    Coupler i is behind vehicle i. The gear's force is stored: it depends on the way by which the
    stretch d was reached. Our forms of the lost equations 8 to 10 (heavy-haul paper); one
    curve, which does not depend on the impact's speed.
    """
    size, joints = consist.size - 1, consist.couplers
    slack, stiffness, ratio, damping = (
        plant.parameter(
            f"coupler[].{name}", values, unit=unit, size=size, minimum=low, nominal=nominal,
            description=f"{text}; our choice",
        )
        for name, values, unit, low, nominal, text in (
            ("slack", [j.slack for j in joints], "m", 0.0, 0.01,
             "free way in all; 9.5 mm at couplers, 0 at drawbars"),
            ("stiffness", [j.gear.stiffness for j in joints], "N/m", 1e3, 1e8,
             "slope between the loading and the unloading curve"),
            ("unloading_ratio", [j.gear.unloading_ratio for j in joints], "1", 0.0, 1.0,
             "unloading curve over loading curve"),
            ("damping", [j.damping for j in joints], "N.s/m", 0.0, 1e5,
             "viscous, parallel to the gear"),
        )
    )  # fmt: skip
    gear = plant.memory(
        "coupler[].gear_force", unit="N", size=size, nominal=1e5,
        description="force of the draft gears, without damping and solid stop",
    )  # fmt: skip
    stretch = plant.memory(
        "coupler[].stretch", unit="m", size=size, nominal=0.01,
        description="stretch of the joint at the last inner step",
    )  # fmt: skip
    branch = None
    if hysteresis == "dahl":
        branch = plant.memory(
            "coupler[].branch", unit="1", size=size, minimum=-1.0, maximum=1.0,
            description="1 on the loading, -1 on the unloading curve",
        )  # fmt: skip
    now = displacement[:-1] - displacement[1:]
    force = gear + damping * (speed[:-1] - speed[1:]) + _stops(consist, now, slack)
    parameters = (slack, stiffness, ratio)
    return Couplers(consist, hysteresis, force, gear, stretch, branch, parameters, damping)


def extension(gear: DraftGear, d: Any, free: Any) -> tuple[Any, Any]:
    """Return how far a joint is beyond its slack, and the gear's stroke (m); signed like d."""
    half = 0.5 * free
    beyond = d - ca.fmin(ca.fmax(d, -half), half)
    return beyond, ca.fmin(ca.fmax(beyond, -gear.stroke), gear.stroke)


def loading_curve(gear: DraftGear, stroke: Any) -> Any:
    """Return the force (N) of a gear that is loaded to a stroke (m) within its own, either way.

    Without branches, so that compilers compute several joints at once.
    """
    law = gear.loading
    if not isinstance(law, PowerLaw):
        return ca.sign(stroke) * ramps(ca.fabs(stroke), law.points)
    slope, most = law.initial_force / law.initial_stroke, law.initial_force
    begun = ca.fmin(ca.fmax(slope * stroke, -most), most)
    scale = law.final_force / gear.stroke**law.exponent
    return begun + scale * stroke * half_power(ca.fabs(stroke), law.exponent - 1.0)


def half_power(x: Any, exponent: float) -> Any:
    """Return x to a power, for x from 0; whole and half powers without pow(), which is slow."""
    whole = int(exponent)
    above = ca.fmax(x, TINY)  # at zero itself the derivative of a root is no number
    if exponent - whole not in (0.0, 0.5) or not 0 <= whole <= 8:
        return above**exponent
    factors = [x] * whole + [ca.sqrt(above)] * (exponent != whole)
    return math.prod(factors)


def _stops(consist: Consist, stretch: Any, slack: Any) -> Any:
    """Return the forces of the solid stops, elastic and parallel to the gears (our choice)."""

    def equations(gear: DraftGear) -> Callable[..., list[Any]]:
        def of(d: Any, free: Any) -> list[Any]:
            beyond, stroke = extension(gear, d, free)
            return [gear.stop_stiffness * (beyond - stroke)]

        return of

    gears = [joint.gear for joint in consist.couplers]
    return mapped_by_kind("stop_of_coupler", equations, gears, stretch, slack)[0]


def _law(hysteresis: Hysteresis) -> Callable[[DraftGear], Callable[..., list[Any]]]:
    """Return the equations (d, d before, F before, branch, Δv, slack, k, ratio) -> [F, branch]."""

    def equations(gear: DraftGear) -> Callable[..., list[Any]]:
        def of(
            d: Any, before: Any, force: Any, h: Any, dv: Any, free: Any, k: Any, ratio: Any
        ) -> list[Any]:
            loading = loading_curve(gear, extension(gear, d, free)[1])
            unloading = ratio * loading
            if hysteresis == "switching":
                return [ca.if_else(d * dv > 0.0, loading, unloading), h]
            low, high = ca.fmin(loading, unloading), ca.fmax(loading, unloading)
            if hysteresis == "incremental":
                return [ca.fmin(ca.fmax(force + k * (d - before), low), high), h]
            # h' = (Δv − h|Δv|) k/(hi − lo + width): exact over the step's way, so always stable
            way = d - before
            end = ca.sign(way)
            h = end + (h - end) * ca.exp(-ca.fabs(way) * k / (high - low + DAHL_WIDTH))
            return [0.5 * (high + low) + 0.5 * (high - low) * h, h]

        return of

    return equations


def gear_forces(
    couplers: Couplers, stretch: Any, relative_speed: Any, *, from_rest: bool = False
) -> tuple[Any, Any]:
    """Return the gears' forces (N) at a stretch, and the branch of the Dahl form.

    incremental: F = clip(F + k Δd, lo, hi). dahl: F = (hi + lo)/2 + (hi − lo)/2 · h. switching:
    the loading curve where d Δv > 0, else the unloading one; it does not converge with the step,
    and is there to show that. `from_rest` takes the way from d = 0.
    """
    zero = ca.MX(0.0)
    branch = zero if couplers.branch is None else couplers.branch
    before = zero if from_rest else couplers.stretch
    gears = [joint.gear for joint in couplers.consist.couplers]
    force, branch = mapped_by_kind(
        "gear_of_coupler", _law(couplers.hysteresis), gears, stretch, before, couplers.gear,
        branch, relative_speed, *couplers.parameters,
    )  # fmt: skip
    return force, branch


def update_couplers(
    plant: Plant, couplers: Couplers, displacement: Any, speed: Any
) -> tuple[Any, Any]:
    """Let the memories follow after each inner step; return the gears' force and the stretch."""
    stretch = displacement[:-1] - displacement[1:]
    relative = speed[:-1] - speed[1:]
    force, branch = gear_forces(couplers, stretch, relative)
    plant.update(couplers.gear, force)
    plant.update(couplers.stretch, stretch)
    if couplers.branch is not None:
        plant.update(couplers.branch, branch)
    total = force + couplers.damping * relative
    total = total + _stops(couplers.consist, stretch, couplers.parameters[0])
    for name, extreme, text in (
        ("highest", ca.fmax, "greatest force so far, over all inner steps"),
        ("lowest", ca.fmin, "least force so far, over all inner steps"),
    ):
        memory = plant.memory(
            f"coupler[].{name}", unit="N", size=couplers.consist.size - 1, nominal=1e5,
            output=True, description=text,
        )  # fmt: skip
        plant.update(memory, extreme(memory, total))
    return force, stretch


def declare_outputs(plant: Plant, couplers: Couplers) -> None:
    """Declare the forces as outputs, and the greatest and the least with their places."""
    force, size = couplers.force, couplers.consist.size - 1
    plant.output(
        "coupler[].force", force, unit="N", nominal=1e5,
        description="force of the coupler behind the vehicle, damping included, tension positive",
    )  # fmt: skip
    places = ca.DM(range(1, size + 1))
    for name, value, what in (
        ("maximum", greatest(force), "greatest"), ("minimum", -greatest(-force), "least"),
    ):  # fmt: skip
        (behind,) = mapped(
            "place_of_extreme", lambda f, most, i: [ca.if_else(f == most, -i, -1e9)],
            force, value, places, count=size,
        )  # fmt: skip
        plant.output(
            f"coupler_{name}", value, unit="N", nominal=1e5,
            description=f"{what} coupler force now, tension positive",
        )  # fmt: skip
        plant.output(
            f"coupler_{name}_at", -greatest(behind), unit="1",
            description=f"number of the coupler with the {what} force; the first one of several",
        )  # fmt: skip
