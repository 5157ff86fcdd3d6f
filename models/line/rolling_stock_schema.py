"""The two versions of railtoolkit's rolling stock schema, and a vehicle as both describe it."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field

from .fields import NotNegative, Number, Positive, Strict
from .train import KMH

Curve = tuple[tuple[float, float], ...]
Place = tuple[int | str, ...]
_Negative = Annotated[Number, Field(lt=0.0)]
_Rotation = Annotated[Number, Field(ge=1.0)]
_Factor = Annotated[Number, Field(ge=0.0, le=1.0)]


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """A vehicle in SI units, whichever version describes it; None where it says nothing.

    `resistance`: the base, rolling and air coefficients in ‰. `curve`: tractive effort, (m/s, N).
    `place`: where it is in the file; `effort_place`, `brake_place`: where these are in it.
    """

    id: str
    kind: Literal["traction unit", "multiple unit", "passenger", "freight", "non-revenue"]
    place: Place
    length: float
    mass: float
    load_limit: float
    mass_traction: float | None
    speed_limit: float | None
    rotation: float | None
    resistance: tuple[float, float, float] | None
    curve: Curve
    force: float
    power: float
    service: float | None
    emergency: float | None
    effort_place: Place
    brake_place: Place

    @property
    def driven(self) -> bool:
        """Whether the vehicle is a traction unit or a multiple unit."""
        return self.kind in ("traction unit", "multiple unit")


class Vehicle2022(Strict):
    """A vehicle of version 2022.05; `a_braking` is not in the schema but in its examples."""

    id: str
    name: str
    uuid: str = Field("", alias="UUID")
    picture: str = ""
    vehicle_type: Literal["traction unit", "freight", "passenger", "multiple unit"]
    power_type: Literal["diesel", "electric", "steam"] | None = None
    length: Positive
    mass: Positive
    load_limit: NotNegative = 0.0
    mass_traction: NotNegative | None = None
    speed_limit: Positive | None = None
    a_braking: _Negative | None = None
    rotation_mass: _Rotation | None = None
    base_resistance: NotNegative = 0.0
    rolling_resistance: NotNegative = 0.0
    air_resistance: NotNegative = 0.0
    tractive_effort: list[tuple[NotNegative, NotNegative]] = []

    def vehicle(self, place: Place) -> Vehicle:
        """Return the vehicle in SI units."""
        return Vehicle(
            **_common(self, place),
            kind=self.vehicle_type,
            rotation=self.rotation_mass,
            resistance=(self.base_resistance, self.rolling_resistance, self.air_resistance),
            curve=tuple((speed / KMH, force) for speed, force in self.tractive_effort),
            force=0.0,
            power=0.0,
            service=-self.a_braking if self.a_braking else None,
            emergency=None,
            effort_place=("tractive_effort",),
            brake_place=("a_braking",),
        )


class Train2022(Strict):
    """A train of version 2022.05."""

    id: str
    name: str
    uuid: str = Field("", alias="UUID")
    formation: Annotated[list[str], Field(min_length=1)]


class File2022(Strict):
    """A rolling stock file of version 2022.05."""

    schema_: str = Field(alias="schema")
    schema_version: str
    trains: list[Train2022] = []
    vehicles: list[Vehicle2022] = []


class _Effort(Strict):
    speed: NotNegative
    force: NotNegative


class _Resistance(Strict):
    model_fidelity: Literal["table", "calculated"]
    rotation_mass: _Rotation | None = None
    base_resistance: NotNegative | None = None
    rolling_resistance: NotNegative | None = None
    air_resistance: NotNegative | None = None
    resistance_effort: list[_Effort] = []


class _Traction(Strict):
    model_fidelity: Literal["table", "calculated"]
    rated_power: NotNegative = 0.0
    initial_tractive_force: NotNegative = 0.0
    tractive_effort: list[_Effort] = []


class _Brakes(Strict):
    model_fidelity: Literal[
        "force", "one-part-deceleration", "two-part-deceleration", "three-part-deceleration"
    ]
    reaction_time: NotNegative | None = None
    response_time: NotNegative | None = None
    threshold_time: NotNegative | None = None
    deceleration: _Negative | None = None
    emergency_deceleration: _Negative | None = None
    eddy_current_brake: dict[str, Any] | None = None
    electrodynamic_brake: dict[str, Any] | None = None
    friction_brake: dict[str, Any] | None = None


class Vehicle2024(Strict):
    """A vehicle of version 2024.07, in which older names may have been left."""

    id: str
    name: str = ""
    uuid: str = Field("", alias="UUID")
    description: str = ""
    picture: str = ""
    vehicle_type: Literal["traction_unit", "freight", "passenger", "multiple_unit", "non-revenue"]
    power_type: Literal["hydraulic", "electric", "steam", "misc"] | None = None
    length: Positive
    mass: Positive
    load_limit: NotNegative = 0.0
    mass_traction: NotNegative | None = None
    speed_limit: Positive | None = None
    resistance: _Resistance | None = None
    traction: _Traction | None = None
    brakes: _Brakes | None = None

    def vehicle(self, place: Place) -> Vehicle:
        """Return the vehicle in SI units."""
        brakes, traction = self.brakes, self.traction
        by_table = traction is not None and traction.model_fidelity == "table"
        calculated = traction is not None and not by_table
        kinds: dict[str, Any] = {"traction_unit": "traction unit", "multiple_unit": "multiple unit"}
        return Vehicle(
            **_common(self, place),
            kind=kinds.get(self.vehicle_type, self.vehicle_type),
            rotation=self.resistance.rotation_mass if self.resistance else None,
            resistance=_coefficients(self.resistance),
            curve=tuple(
                (effort.speed / KMH, 1000.0 * effort.force)
                for effort in (traction.tractive_effort if traction and by_table else [])
            ),
            force=1000.0 * traction.initial_tractive_force if traction and calculated else 0.0,
            power=1000.0 * traction.rated_power if traction and calculated else 0.0,
            service=-brakes.deceleration if brakes and brakes.deceleration else None,
            emergency=(
                -brakes.emergency_deceleration if brakes and brakes.emergency_deceleration else None
            ),
            effort_place=("traction", "tractive_effort"),
            brake_place=("brakes",),
        )


class _Simplified(Strict):
    speed_limit: Positive
    length: Positive
    acceleration: Positive
    deceleration: _Negative
    emergency_deceleration: _Negative | None = None
    coasting: Number = 0.0


class Train2024(Strict):
    """A train of version 2024.07, in which older names may have been left."""

    id: str
    name: str = ""
    uuid: str = Field("", alias="UUID")
    description: str = ""
    train_type: str = ""
    formation: list[str] = []
    loading_factor: list[_Factor] = []
    simplified_characteristics: _Simplified | None = None


class File2024(Strict):
    """A rolling stock file of version 2024.07."""

    schema_: str = Field(alias="schema")
    schema_version: str
    model_fidelity: Literal["simplified", "detailed"]
    trains: list[Train2024] = []
    vehicles: list[Vehicle2024] = []


def _common(vehicle: Vehicle2022 | Vehicle2024, place: Place) -> dict[str, Any]:
    return {
        "id": vehicle.id,
        "place": place,
        "length": vehicle.length,
        "mass": 1000.0 * vehicle.mass,
        "load_limit": 1000.0 * vehicle.load_limit,
        "mass_traction": 1000.0 * vehicle.mass_traction if vehicle.mass_traction else None,
        "speed_limit": vehicle.speed_limit / KMH if vehicle.speed_limit else None,
    }


def _coefficients(resistance: _Resistance | None) -> tuple[float, float, float] | None:
    """Return the three coefficients; None where only a table is given."""
    if resistance is None:
        return (0.0, 0.0, 0.0)
    given = (
        resistance.base_resistance, resistance.rolling_resistance, resistance.air_resistance
    )  # fmt: skip
    if None in given or resistance.model_fidelity == "table":
        return None
    base, rolling, air = (value or 0.0 for value in given)
    return base, rolling, air
