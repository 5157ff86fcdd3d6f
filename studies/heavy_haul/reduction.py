"""The heavy-haul train reduced to what a handling plan has to know."""

import math

from ...base.errors import ParameterError
from ...controllers.train_handling import ForceCurve, ReducedBrake, ReducedTrain
from ...models.consist import Consist, Envelope, ShoeBrake
from ...models.heavy_haul.air_brake import feeds

KILOPASCAL = 1e3


def reduced_train(consist: Consist) -> ReducedTrain:
    """Return the reduced train of a consist whose locomotives are alike, and its wagons' brakes.

    All locomotives are taken to pull alike. Raise ParameterError for different ones.
    """
    engines = [v for v in consist.vehicles if v.is_locomotive]
    curves = {(v.traction, v.electric_brake) for v in engines}
    brakes = {v.brake for v in consist.vehicles if v.brake is not None}
    if len(curves) > 1 or len(brakes) > 1:
        raise ParameterError(
            f"consist '{consist.name}': can be reduced only if its locomotives are alike, and the "
            "air brakes of its wagons too"
        )
    ((traction, electric),) = curves
    count = len(engines)
    return ReducedTrain(
        masses=tuple(v.mass for v in consist.vehicles),
        lengths=tuple(v.length for v in consist.vehicles),
        resistances=tuple(
            (v.resistance.constant, v.resistance.linear, v.resistance.quadratic)
            for v in consist.vehicles
        ),
        shares=tuple(v.is_locomotive / count for v in consist.vehicles),
        traction=_curve(traction, count),
        electric_brake=_curve(electric, count),
        braked=tuple(v.brake is not None for v in consist.vehicles),
        brake=_brake(consist, brakes.pop()) if brakes else None,
    )


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
    far = _distance(consist)
    return ReducedBrake(
        full_pressure=brake.cylinder_pressure / KILOPASCAL,
        area=bore * brake.rigging_ratio * brake.efficiency / brake.shoes,
        shoes=float(brake.shoes),
        service=brake.service,
        application_time=consist.application_time + far / consist.application_speed,
        release_time=consist.release_time + far / consist.release_speed,
    )


def _distance(consist: Consist) -> float:
    """Return how far (m) the brake wave runs to the braked wagons, in the mean."""
    ways: dict[int, float] = {}
    sources = feeds(consist)
    pending = list(range(consist.size))
    while pending:
        i = pending.pop(0)
        feed, own = sources[i], consist.vehicles[i].length
        if feed.neighbour is None:
            ways[i] = own
        elif feed.neighbour in ways:
            ways[i] = ways[feed.neighbour] + own
        else:
            pending.append(i)
    braked = [ways[i] for i, v in enumerate(consist.vehicles) if v.brake is not None]
    return sum(braked) / len(braked)
