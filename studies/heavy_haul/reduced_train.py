"""The heavy-haul train reduced to what a handling plan has to know."""

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from ...base.errors import ParameterError
from ...controllers.train_handling import ForceCurve, ReducedBrake, ReducedTrain
from ...controllers.train_handling.checks import shown
from ...models.consist import Consist, Envelope, ShoeBrake
from ...models.heavy_haul.brake_pipe import feeds

KILOPASCAL = 1e3


def reduced_train(consist: Consist) -> ReducedTrain:
    """Return the reduced train of a consist whose locomotives are alike, which all pull alike.

    Where the wagons' air brakes differ it has none to plan with, and says so to who wants to.
    Raise ParameterError for locomotives that differ.
    """
    if not isinstance(consist, Consist):
        raise ParameterError(
            f"reduced_train: consist must be a Consist, not {shown(consist)}; "
            "read_consist(file) gives one"
        )
    vehicles = consist.vehicles
    engines = [i for i, v in enumerate(vehicles) if v.is_locomotive]
    other = _difference(consist, engines, ("traction", "electric_brake"))
    if other:
        raise ParameterError(
            f"consist '{consist.name}': only a train with locomotives alike can be reduced, but "
            f"{other}; make them alike, or a ReducedTrain with the curves of all together"
        )
    braked = [i for i, v in enumerate(vehicles) if v.brake is not None]
    other = _difference(consist, braked, ("brake",))
    if other:
        other += "; plan without air_brake, or give all wagons the same brake"
    count, first = len(engines), vehicles[engines[0]]
    brake = vehicles[braked[0]].brake if braked and not other else None
    return ReducedTrain(
        masses=tuple(v.mass for v in vehicles),
        lengths=tuple(v.length for v in vehicles),
        resistances=tuple(
            (v.resistance.constant, v.resistance.linear, v.resistance.quadratic) for v in vehicles
        ),
        shares=tuple(v.is_locomotive / count for v in vehicles),
        traction=_curve(first.traction, count),
        electric_brake=_curve(first.electric_brake, count),
        braked=tuple(v.brake is not None for v in vehicles),
        brake=None if brake is None else _brake(consist, brake),
        without_brake=other,
    )


def _difference(consist: Consist, indices: Sequence[int], parts: Sequence[str]) -> str:
    """Return what the first vehicle that differs from the first one has otherwise, or nothing."""
    for i in indices:
        first, other = consist.vehicles[indices[0]], consist.vehicles[i]
        for part in parts:
            ours, theirs = getattr(first, part), getattr(other, part)
            if ours != theirs:
                names = f"'{first.name}' and '{other.name}' (vehicles {indices[0]} and {i}, from 0)"
                return f"{names} differ in {part}{_within(ours, theirs)}"
    return ""


def _within(one: Any, other: Any) -> str:
    """Return which fields of two parts differ, as `.power`; nothing if one has none at all."""
    if one is None or other is None:
        return f", which {'the former' if one is None else 'the latter'} has not"
    unlike = [f.name for f in fields(one) if getattr(one, f.name) != getattr(other, f.name)]
    return f" ({', '.join(unlike)})"


def _curve(envelope: Envelope | None, count: int) -> ForceCurve:
    if envelope is None:
        return ForceCurve(points=((0.0, 0.0),))
    return ForceCurve(
        points=tuple((v, count * force) for v, force in envelope.points),
        power=math.inf if envelope.power is None else count * envelope.power,
    )


def _brake(consist: Consist, brake: ShoeBrake) -> ReducedBrake:
    """Return the wagons' brake, its lags longer by the mean time that the pipe's wave takes."""
    bore = math.pi / 4.0 * brake.cylinder_diameter**2 * brake.cylinders
    applied, released = _ways(consist)
    return ReducedBrake(
        full_pressure=brake.cylinder_pressure / KILOPASCAL,
        area=bore * brake.rigging_ratio * brake.efficiency / brake.shoes,
        shoes=float(brake.shoes),
        service=brake.service,
        application_time=consist.application_time + applied / consist.application_speed,
        release_time=consist.release_time + released / consist.release_speed,
    )


def _ways(consist: Consist) -> tuple[float, float]:
    """Return how far (m) an application's and a release's wave run to the braked wagons, in mean.

    From an end-of-train device comes the application alone, where it is there first.
    """
    device, speed = consist.end_of_train, consist.application_speed
    applied, released = [], []
    behind = consist.length
    for vehicle, feed in zip(consist.vehicles, feeds(consist), strict=True):
        if vehicle.brake is not None:
            early = device is not None and device.radio_delay + behind / speed < feed.time
            applied.append(behind if early else feed.way)
            released.append(feed.way)
        behind -= vehicle.length
    return sum(applied) / len(applied), sum(released) / len(released)
