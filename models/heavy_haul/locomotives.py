"""The locomotives: what they are asked for, and what they can give at their speed."""

from collections.abc import Callable
from typing import Any, NamedTuple

import casadi as ca

from ...base.railway import KILOMETRES_PER_HOUR
from ..consist import Consist, Envelope, Vehicle
from ..plant import Plant
from .mapping import mapped_by_kind, ramps, total

SLOW = 0.1 / KILOMETRES_PER_HOUR  # m/s; below it a power limit means nothing


class Locomotives(NamedTuple):
    """Forces in N as symbols: of every vehicle (zero for wagons), and of every group.

    And the powers of all traction and of all electric brakes, in W.
    """

    forces: Any
    traction: Any
    braking: Any
    applied: Any
    upper: Any
    lower: Any


def envelope_force(envelope: Envelope, speed: Any) -> Any:
    """Return the greatest force (N) at a speed (m/s, from 0)."""
    force = ramps(speed, envelope.points)
    if envelope.power is None:
        return force
    return ca.fmin(force, envelope.power / ca.fmax(speed, SLOW))


def declare_locomotives(plant: Plant, consist: Consist, speed: Any) -> Locomotives:
    """Declare the groups' inputs; return the forces.

    A group's demand (N, traction positive) is shared equally by its locomotives, and each keeps
    within its own traction and electric brake (heavy-haul paper, eqs. 3 and 4, whose numbers are
    lost: see the consist). The electric brake gives nothing to a train that rolls backwards.
    """
    size = len(consist.groups)
    demand = plant.input(
        "group[].force", unit="N", size=size, nominal=1e5,
        description="force demanded of a group of locomotives, traction positive, electric brake "
        "negative",
    )  # fmt: skip
    rows = [i for group in consist.groups for i in group]
    shares = [1.0 / len(group) for group in consist.groups for _ in group]
    of_group = [k for k, group in enumerate(consist.groups) for _ in group]
    kinds = [consist.vehicles[i] for i in rows]
    given, upper, lower = mapped_by_kind(
        "forces_of_locomotive",
        _equations,
        kinds,
        demand[of_group, 0] * ca.DM(shares),
        speed[rows, 0],
    )
    speeds = speed[rows, 0]
    traction = total(ca.fmax(given, 0.0) * speeds)
    braking = -total(ca.fmin(given, 0.0) * speeds)
    forces = ca.vertcat(given, ca.MX(ca.DM.zeros(1)))
    order = [rows.index(i) if i in rows else len(rows) for i in range(consist.size)]
    sums = (_sums(of_group, size, values) for values in (given, upper, lower))
    found = Locomotives(forces[order, 0], traction, braking, *sums)
    for name, value, text in (
        ("applied", found.applied, "force at the wheels"),
        ("upper", found.upper, "greatest traction at this speed"),
        ("lower", found.lower, "greatest electric brake at this speed (negative)"),
    ):
        plant.output(
            f"group[].{name}", value, unit="N", nominal=1e5,
            description=f"{text} of the group's locomotives",
        )  # fmt: skip
    return found


def _sums(of_group: list[int], size: int, values: Any) -> Any:
    rows = [[i for i, group in enumerate(of_group) if group == k] for k in range(size)]
    return ca.vertcat(*(total(values[own, 0]) for own in rows))


def _equations(vehicle: Vehicle) -> Callable[..., list[Any]]:
    def of(demand: Any, speed: Any) -> list[Any]:
        upper = lower = ca.SX(0.0)
        if vehicle.traction is not None:
            upper = envelope_force(vehicle.traction, ca.fabs(speed))
        if vehicle.electric_brake is not None:
            lower = -envelope_force(vehicle.electric_brake, ca.fmax(speed, 0.0))
        return [ca.fmin(ca.fmax(demand, lower), upper), upper, lower]

    return of
