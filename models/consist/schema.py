"""What a consist file may hold: types of keys; ranges are checked where the parts are made.

Units are the railway's: t, m, km/h, kN, kW, N/kN, mm and kPa, as said at each key.
"""

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from ..line.fields import Number, Pair, Strict

SCHEMA = "railcosim-consist"
MOST = 1000  # of each kind of thing in a file

_Curve = Annotated[list[Pair], Field(max_length=MOST)]
_Whole = Annotated[int, Field(strict=True)]
_Times = Annotated[int, Field(strict=True, ge=1, le=1_000_000)]


def _known_version(value: object) -> object:
    """Return the version as a text; YAML reads it as a number if it has no quotes."""
    if value == "1" or (type(value) is int and value == 1):
        return "1"
    raise ValueError("the version is not known; known is 1")


class Resistance(Strict):
    """N/kN, per km/h and per (km/h)²; `starting` below 2.5 km/h, in N/kN."""

    constant: Number | None = None
    linear: Number | None = None
    quadratic: Number | None = None
    starting: Number | None = None


class Curve(Strict):
    """`points` in km/h and kN, `power` in kW."""

    points: _Curve | None = None
    power: Number | None = None


class Brake(Strict):
    """Diameter in mm, cylinder pressure and reductions in kPa."""

    cylinder_diameter: Number | None = None
    cylinders: _Whole | None = None
    rigging_ratio: Number | None = None
    efficiency: Number | None = None
    shoes: _Whole | None = None
    cylinder_pressure: Number | None = None
    service: _Curve | None = None


class VehicleType(Strict):
    """Mass in t, length in m; what is not given is that of the type it is `like`."""

    like: str | None = None
    mass: Number | None = None
    length: Number | None = None
    resistance: Resistance | None = None
    brake: Brake | None = None
    traction: Curve | None = None
    electric_brake: Curve | None = None


class Loading(Strict):
    """Either `points` in mm and kN, or the power law's numbers in kN and mm."""

    points: _Curve | None = None
    initial_force: Number | None = None
    initial_stroke: Number | None = None
    final_force: Number | None = None
    exponent: Number | None = None

    @model_validator(mode="after")
    def _is_one_of_both(self) -> Self:
        if self.points is not None and len(self.model_fields_set) > 1:
            raise ValueError("either 'points' or the power law's numbers are wanted, not both")
        return self


class Gear(Strict):
    """Stroke in mm per joint, stiffnesses in MN/m (kN/mm)."""

    like: str | None = None
    stroke: Number | None = None
    loading: Loading | None = None
    unloading_ratio: Number | None = None
    stiffness: Number | None = None
    stop_stiffness: Number | None = None


class Joint(Strict):
    """Slack in mm, damping in kN·s/m."""

    gear: str
    slack: Number | None = None
    damping: Number | None = None


class Item(Strict):
    """A vehicle or a set, so many `times`, each with `coupler` behind it."""

    vehicle: str | None = None
    set: str | None = None
    times: _Times = 1
    coupler: str | None = None

    @model_validator(mode="before")
    @classmethod
    def _is_no_name(cls, value: object) -> object:
        if isinstance(value, str):
            raise ValueError(f"write {{vehicle: {value}}}, or {{set: {value}}} if it is a set")
        return value

    @model_validator(mode="after")
    def _is_one_of_both(self) -> Self:
        if (self.vehicle is None) == (self.set is None):
            raise ValueError("either 'vehicle' or 'set' is wanted, with the name of one")
        return self


Items = Annotated[list[Item], Field(min_length=1, max_length=MOST)]


class Set(Strict):
    """Items that `coupler` joins."""

    items: Items
    coupler: str | None = None


class Device(Strict):
    """The controllable end-of-train device; its radio delay in s."""

    radio_delay: Number | None = None


class File(Strict):
    """A consist file; speeds of the brake's waves in m/s, times in s, groups from 0."""

    schema_: Literal["railcosim-consist"] = Field(alias="schema")
    schema_version: Annotated[Literal["1"], BeforeValidator(_known_version)]
    name: str
    description: str = ""
    draft_gears: Annotated[dict[str, Gear], Field(max_length=MOST)]
    couplers: Annotated[dict[str, Joint], Field(min_length=1, max_length=MOST)]
    vehicles: Annotated[dict[str, VehicleType], Field(max_length=MOST)]
    sets: Annotated[dict[str, Set], Field(max_length=MOST)] = {}
    train: Items
    coupler: str | None = None
    groups: Annotated[list[Annotated[list[_Whole], Field(max_length=MOST)]],
                      Field(max_length=MOST)] = []  # fmt: skip
    end_of_train: Device | None = None
    radio_delay: Number | None = None
    application_speed: Number | None = None
    release_speed: Number | None = None
    application_time: Number | None = None
    release_time: Number | None = None

    @field_validator("end_of_train", mode="before")
    @classmethod
    def _is_a_device(cls, value: object) -> object:
        if not isinstance(value, dict | Device):
            raise ValueError(
                "write {} or {radio_delay: 1.0} for a device, and leave the key out for none"
            )
        return value
