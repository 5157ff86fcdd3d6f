"""Rolling stock of railtoolkit/schema, versions 2022.05 and 2024.07, as YAML or JSON.

A train is a formation of vehicles. The schema gives coefficients of resistance without a formula;
ours is the one of TrainRuns.jl (after Wende, Fahrdynamik des Schienenverkehrs), without its head
wind, in ‰ of the vehicle's weight with V in km/h: traction and multiple units have base on the
driving axles and rolling on the others, + air (V/100)²; passenger cars have
base + rolling V/100 + air (V/100)²; other vehicles the same without rolling.
"""

from itertools import pairwise

from numpy import interp

from ...base.errors import ParameterError, listing, suggest
from .document import Document
from .railtoolkit import checked_version, chosen
from .rolling_stock_schema import Curve, File2022, File2024, Place, Train2024, Vehicle
from .train import Davis, Train

SCHEMA = "https://railtoolkit.org/schema/rolling-stock.json"
# What TrainRuns.jl assumes where version 2022.05 says nothing.
ROTATING = {True: 1.09, False: 1.06}  # rotating mass factor of vehicles with traction, without
BRAKE = {True: 0.225, False: 0.375}  # m/s², service brake with freight vehicles, without


def train_from_rolling_stock(document: Document, name: str = "") -> Train:
    """Return the train of a rolling stock file, chosen by its id if there are several.

    Crush load is every vehicle at its load limit; `mass` and the nominal load follow the loading
    factors, and are the crush load without any, as in TrainRuns.jl. Raise FileError with the
    place of what is wrong.
    """
    version = checked_version(document)
    file = document.validated(File2022 if version == "2022.05" else File2024)
    if isinstance(file, File2024) and file.model_fidelity == "simplified":
        document.fail(
            ("model_fidelity",),
            "a simplified train has no mass, resistance or traction force; only 'detailed' is read",
        )
    if not file.trains:
        document.fail((), "'trains' is missing: vehicles alone are not a train")
    index = chosen(document, "trains", [train.id for train in file.trains], name)
    given, where = file.trains[index], ("trains", index)
    vehicles = [
        vehicle.vehicle(("vehicles", position)) for position, vehicle in enumerate(file.vehicles)
    ]
    formation = _formation(document, where, given.formation, vehicles)
    is_new = isinstance(given, Train2024)
    factors = given.loading_factor if is_new else []
    loads = _loads(document, where, factors, formation)
    try:
        return _train(
            document, where, formation, loads,
            name=given.id, description=given.description or given.name if is_new else given.name,
        )  # fmt: skip
    except ParameterError as error:
        document.fail(where, str(error))


def _train(
    document: Document,
    where: Place,
    formation: list[Vehicle],
    loads: list[float],
    *,
    name: str,
    description: str,
) -> Train:
    empty = sum(vehicle.mass for vehicle in formation)
    rotating = sum(
        vehicle.mass * (vehicle.rotation or ROTATING[vehicle.driven]) for vehicle in formation
    )
    force, power, curve = _traction(document, where, formation)
    service, emergency = _brakes(document, where, formation)
    speeds = [vehicle.speed_limit for vehicle in formation if vehicle.speed_limit]
    if not speeds:
        document.fail(where, "no vehicle of the train has a 'speed_limit'")
    return Train(
        name=name,
        mass=empty + sum(loads),
        mass_empty=empty,
        mass_loaded=empty + sum(loads),
        mass_crush=empty + sum(vehicle.load_limit for vehicle in formation),
        length=sum(vehicle.length for vehicle in formation),
        davis=_davis(document, where, formation, loads),
        max_traction_force=force,
        max_power=power,
        max_speed=min(speeds),
        service_deceleration=service,
        emergency_deceleration=emergency,
        rotating_mass_factor=rotating / empty,
        traction_curve=curve,
        description=description,
    )


def _formation(
    document: Document, where: Place, names: list[str], vehicles: list[Vehicle]
) -> list[Vehicle]:
    known: dict[str, Vehicle] = {}
    for vehicle in vehicles:
        if vehicle.id in known:
            document.fail((*vehicle.place, "id"), f"'{vehicle.id}' is also an earlier one's id")
        known[vehicle.id] = vehicle
    if not names:
        document.fail(where, "'formation' is missing: which vehicles form the train")
    for position, name in enumerate(names):
        if name not in known:
            document.fail(
                (*where, "formation", position),
                f"no vehicle '{name}'; vehicles: {listing(known)}{suggest(name, known)}",
            )
    return [known[name] for name in names]


def _loads(
    document: Document, where: Place, factors: list[float], formation: list[Vehicle]
) -> list[float]:
    """Return each vehicle's load in kg."""
    if len(factors) not in (0, 1, len(formation)):
        document.fail(
            (*where, "loading_factor"), f"{len(factors)} factors for {len(formation)} vehicles"
        )
    if len(factors) != len(formation):
        factors = (factors or [1.0]) * len(formation)
    return [vehicle.load_limit * factor for vehicle, factor in zip(formation, factors, strict=True)]


def _davis(document: Document, where: Place, formation: list[Vehicle], loads: list[float]) -> Davis:
    """Return the train's coefficients: its vehicles', weighted with their masses as loaded."""
    masses = [vehicle.mass + load for vehicle, load in zip(formation, loads, strict=True)]
    coefficients = [_coefficients(document, vehicle) for vehicle in formation]
    if not any(any(each) for each in coefficients):
        document.fail(where, "no vehicle of the train has a resistance")
    a, b, c = (
        sum(mass * value for mass, value in zip(masses, values, strict=True)) / sum(masses)
        for values in zip(*coefficients, strict=True)
    )
    return Davis(a=a, b=b / 100.0, c=c / 100.0**2)


def _coefficients(document: Document, vehicle: Vehicle) -> tuple[float, float, float]:
    """Return a vehicle's resistance in ‰ of its weight as a polynomial in V/(100 km/h)."""
    if vehicle.resistance is None:
        document.fail(
            (*vehicle.place, "resistance"),
            "a table is not read: 'calculated' with base_resistance, rolling_resistance and "
            "air_resistance is needed",
        )
    base, rolling, air = vehicle.resistance
    if vehicle.driven:
        driving = min((vehicle.mass_traction or vehicle.mass) / vehicle.mass, 1.0)
        return base * driving + rolling * (1.0 - driving), 0.0, air
    return base, rolling if vehicle.kind == "passenger" else 0.0, air


def _traction(
    document: Document, where: Place, formation: list[Vehicle]
) -> tuple[float, float, Curve]:
    """Return the train's largest force (N) and power (W), and its curve where there are tables.

    Tables of several vehicles are added at all their speeds. Force and power are the largest on
    that curve, so they alone allow more than it does.
    """
    curves = [vehicle.curve for vehicle in formation if vehicle.curve]
    force = sum(vehicle.force for vehicle in formation)
    power = sum(vehicle.power for vehicle in formation)
    if curves and (force or power):
        document.fail(where, "traction by table and by rated power in one train is not read")
    for vehicle in formation:
        for position, (low, high) in enumerate(pairwise(vehicle.curve), start=1):
            if high[0] <= low[0]:
                document.fail(
                    (*vehicle.place, *vehicle.effort_place, position), "the speeds do not rise"
                )
    curve: Curve = ()
    if curves:
        speeds = sorted({speed for each in curves for speed, _ in each})
        forces = [sum(_force(each, speed) for each in curves) for speed in speeds]
        curve = tuple(zip(speeds, forces, strict=True))
        force, power = max(forces), max(speed * effort for speed, effort in curve)
    if not (force and power):
        document.fail(where, "no vehicle of the train has a tractive force and a power")
    return force, power, curve


def _force(curve: Curve, speed: float) -> float:
    speeds, forces = zip(*curve, strict=True)
    return float(interp(speed, speeds, forces))


def _brakes(document: Document, where: Place, formation: list[Vehicle]) -> tuple[float, float]:
    """Return the service and emergency deceleration: the weakest that a vehicle states."""
    braked = [(vehicle.service, vehicle.emergency) for vehicle in formation]
    service = [value for value, _ in braked if value]
    if not service:
        vehicle = formation[0]
        if vehicle.brake_place == ("brakes",):
            document.fail(
                where, "no vehicle of the train has brakes with a deceleration; forces are not read"
            )
        service = [BRAKE[any(vehicle.kind == "freight" for vehicle in formation)]]
    emergency = [other or value for value, other in braked if value]
    return min(service), min(emergency or service)
