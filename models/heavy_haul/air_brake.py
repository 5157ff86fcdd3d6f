"""The pneumatic brake: the wave in the pipe, the cylinders, and the shoes."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ...base.railway import KILOMETRES_PER_HOUR
from ..consist import Consist, Vehicle
from ..plant import Plant
from .mapping import mapped, mapped_by_kind, ramps

KILOPASCAL = 1e3
Service = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Feed:
    """Where a vehicle's part of the pipe is filled from: an input, or a neighbour."""

    source: int | None = None
    neighbour: int | None = None


def feeds(consist: Consist) -> list[Feed]:
    """Return, for each vehicle, whence the brake wave reaches it first.

    The pipe is vented at the first locomotive of each group, and at the last vehicle by the
    end-of-train device. The first group's command is there at once, the others' after the radio
    delay. What counts is the wave of an application; a release takes the same ways (our choice).
    """
    starts = [(group[0], 0.0 if k == 0 else consist.radio_delay)
              for k, group in enumerate(consist.groups)]  # fmt: skip
    if consist.end_of_train is not None:
        starts.append((consist.size - 1, consist.end_of_train.radio_delay))
    times = [v.length / consist.application_speed for v in consist.vehicles]
    best = [math.inf] * consist.size
    found = [Feed()] * consist.size
    for source, (at, delay) in enumerate(starts):
        for step in (1, -1):
            time, i = delay, at
            while 0 <= i < consist.size:
                time += times[i]
                if time < best[i]:
                    best[i] = time
                    found[i] = Feed(source) if i == at else Feed(neighbour=i - step)
                i += step
    return found


def declare_air_brake(plant: Plant, consist: Consist, speed: Any) -> Any:
    """Declare the pipe and the cylinders; return the shoes' friction of each vehicle, in N.

    r_i' = (r of the neighbour towards the source − r_i)/τ, with τ the vehicle's length over the
    wave's speed: a cascade of lags, so the wave's front spreads as the square root of the number of
    vehicles (our choice; from memory, 250 m/s for application and 160 m/s for release). The
    cylinder follows the service curve with a first-order lag. Shoes: heavy-haul paper, eq. 7, in
    the usual Chinese form, from memory: K = (π/4) dz² pz ηz γz nz/nk, FB = nk K φ,
    φ = 0.41 (K + 200)/(4 K + 200) · (V + 150)/(2 V + 150), K in kN, V in km/h.
    """
    reduction = plant.input(
        "group[].reduction", unit="kPa", size=len(consist.groups), minimum=0.0, maximum=600.0,
        nominal=100.0, description="brake pipe reduction at the group's first locomotive",
    )  # fmt: skip
    if consist.end_of_train is not None:
        rear = plant.input(
            "end_of_train.reduction", unit="kPa", minimum=0.0, maximum=600.0, nominal=100.0,
            description="brake pipe reduction at the last vehicle; its radio delay is the "
            "diagram's",
        )  # fmt: skip
        reduction = ca.vertcat(reduction, rear)
    pipe = _pipe(plant, consist, reduction)
    cylinder = _cylinders(plant, consist, pipe)
    area = plant.parameter(
        "vehicle[].brake_area", [_area(v) for v in consist.vehicles], unit="m2", size=consist.size,
        minimum=0.0, nominal=0.1,
        description="force of one shoe over cylinder pressure; 0 for a vehicle without air brake",
    )  # fmt: skip
    shoes = [0.0 if v.brake is None else float(v.brake.shoes) for v in consist.vehicles]
    count = plant.parameter(
        "vehicle[].shoes", shoes, unit="1", size=consist.size, minimum=0.0,
        description="number of brake shoes",
    )  # fmt: skip
    (force,) = mapped("shoes_of_vehicle", _shoes, cylinder, speed, area, count, count=consist.size)
    return force


def _area(vehicle: Vehicle) -> float:
    brake = vehicle.brake
    if brake is None:
        return 0.0
    bore = math.pi / 4.0 * brake.cylinder_diameter**2 * brake.cylinders
    return bore * brake.rigging_ratio * brake.efficiency / brake.shoes


def _shoes(cylinder: Any, v: Any, area: Any, shoes: Any) -> list[Any]:
    k = area * cylinder  # m² · kPa = kN
    speed = KILOMETRES_PER_HOUR * ca.fabs(v)
    above, below = (k + 200.0) * (speed + 150.0), (4.0 * k + 200.0) * (2.0 * speed + 150.0)
    return [410.0 * shoes * k * above / below]


def _pipe(plant: Plant, consist: Consist, reduction: Any) -> Any:
    application, release = (
        plant.parameter(
            f"brake_pipe.{name}_speed", start, unit="m/s", minimum=1.0, maximum=1000.0,
            nominal=100.0, description=f"speed of the brake wave at {name}; from memory",
        )
        for name, start in (
            ("application", consist.application_speed), ("release", consist.release_speed),
        )
    )  # fmt: skip
    pipe = plant.state(
        "vehicle[].pipe_reduction", unit="kPa", size=consist.size, minimum=0.0, nominal=100.0,
        output=True, description="reduction of the brake pipe's pressure at the vehicle",
    )  # fmt: skip
    lengths = [v.length for v in consist.vehicles]
    first = reduction.shape[0]
    places = [
        feed.source if feed.source is not None else first + (feed.neighbour or 0)
        for feed in feeds(consist)
    ]
    before = ca.vertcat(reduction, pipe)[places, 0]

    def equations(r: Any, ahead: Any, per_length: Any, fast: Any, slow: Any) -> list[Any]:
        return [_lag(ahead - r, fast, slow) * per_length]

    (rate,) = mapped(
        "pipe_of_vehicle", equations, pipe, before, 1.0 / ca.DM(lengths), application, release,
        count=consist.size,
    )  # fmt: skip
    plant.der(pipe, rate)
    return pipe


def _cylinders(plant: Plant, consist: Consist, pipe: Any) -> Any:
    application, release = (
        plant.parameter(
            f"brake_cylinder.{name}_time", start, unit="s", minimum=0.02, nominal=1.0,
            description=f"time constant of the brake cylinders at {name}; our choice",
        )
        for name, start in (
            ("application", consist.application_time), ("release", consist.release_time),
        )
    )  # fmt: skip
    pressures = [0.0 if v.brake is None else v.brake.cylinder_pressure / KILOPASCAL
                 for v in consist.vehicles]  # fmt: skip
    full = plant.parameter(
        "vehicle[].full_pressure", pressures, unit="kPa", size=consist.size, minimum=0.0,
        nominal=100.0, description="cylinder pressure at full service; our choice",
    )  # fmt: skip
    cylinder = plant.state(
        "vehicle[].cylinder_pressure", unit="kPa", size=consist.size, minimum=0.0, nominal=100.0,
        output=True, description="pressure in the brake cylinder",
    )  # fmt: skip
    curves = [((0.0, 0.0), (1.0, 0.0)) if v.brake is None else v.brake.service
              for v in consist.vehicles]  # fmt: skip

    def equations(service: Service) -> Callable[..., list[Any]]:
        def of(p: Any, r: Any, most: Any, on: Any, off: Any) -> list[Any]:
            return [_lag(most * ramps(r, service) - p, on, off)]

        return of

    (rate,) = mapped_by_kind(
        "cylinder_of_vehicle", equations, _merged(curves), cylinder, pipe, full,
        1.0 / application, 1.0 / release,
    )  # fmt: skip
    plant.der(cylinder, rate)
    return cylinder


def _lag(missing: Any, up: Any, down: Any) -> Any:
    """Return what a lag makes up per s, at the rate `up` (1/s) or `down`, without a branch."""
    return 0.5 * (up + down) * missing + 0.5 * (up - down) * ca.fabs(missing)


def _merged(curves: list[Service]) -> list[Service]:
    """Return the curves, with that of most vehicles for those without an air brake.

    Their full pressure is zero, so any will do, and one curve for all is one loop.
    """
    real = [curve for curve in curves if curve[-1][1] > 0.0]
    usual = max(set(real), key=real.count) if real else curves[0]
    return [curve if curve[-1][1] > 0.0 else usual for curve in curves]
