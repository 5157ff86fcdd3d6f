"""The pneumatic brake: the wave in the pipe, the cylinders, and the shoes."""

import math
from collections.abc import Callable
from typing import Any

import casadi as ca

from ...base.railway import KILOMETRES_PER_HOUR
from ..consist import Consist, Vehicle
from ..plant import Plant
from .brake_pipe import declare_pipe, lag
from .mapping import mapped, mapped_by_kind, ramps

KILOPASCAL = 1e3
Service = tuple[tuple[float, float], ...]


def declare_air_brake(plant: Plant, consist: Consist, speed: Any, length: Any) -> Any:
    """Declare the pipe and the cylinders; return the shoes' friction of each vehicle, in N.

    The cylinder follows the service curve with a first-order lag. Shoes: heavy-haul paper, eq. 7,
    in the usual Chinese form, from memory: K = (π/4) dz² pz ηz γz nz/nk, FB = nk K φ,
    φ = 0.41 (K + 200)/(4 K + 200) · (V + 150)/(2 V + 150), K in kN, V in km/h.
    """
    pipe = declare_pipe(plant, consist, length)
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
            return [lag(most * ramps(r, service) - p, on, off)]

        return of

    (rate,) = mapped_by_kind(
        "cylinder_of_vehicle", equations, _merged(curves), cylinder, pipe, full,
        1.0 / application, 1.0 / release,
    )  # fmt: skip
    plant.der(cylinder, rate)
    return cylinder


def _merged(curves: list[Service]) -> list[Service]:
    """Return the curves, with that of most vehicles for those without an air brake.

    Their full pressure is zero, so any will do, and one curve for all is one loop.
    """
    real = [curve for curve in curves if curve[-1][1] > 0.0]
    usual = max(set(real), key=real.count) if real else curves[0]
    return [curve if curve[-1][1] > 0.0 else usual for curve in curves]
