"""A train as a list of vehicles and of the couplers between them; SI units."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from ...base.errors import listing
from .checks import Check, settle
from .draft_gear import Coupler
from .vehicle import Vehicle

SHORTEST, LONGEST = 2, 1000  # vehicles
STEP = 1e-3  # s, the inner step by which a train is integrated
Groups = tuple[tuple[int, ...], ...]


@dataclass(frozen=True, kw_only=True)
class EndOfTrain:
    """A controllable end-of-train device: it vents the brake pipe at the last vehicle too.

    The command reaches it by radio after `radio_delay` in s, our choice. Raise ParameterError for
    what cannot be.
    """

    radio_delay: float = 1.0

    def __post_init__(self) -> None:
        Check("end of train").within(("radio_delay",), self.radio_delay, 0.0, 60.0, "s")


@dataclass(frozen=True, kw_only=True)
class Consist:
    """A train of 2 to 1000 vehicles, the first in front; coupler i joins vehicles i and i + 1.

    `groups` are the indices (from 0) of locomotives that act together; group 0 leads and holds
    vehicle 0, and every locomotive is in one group. Empty means: locomotives next to each other
    are a group. The commands of the other groups come `radio_delay` s after those of group 0.

    A brake command runs along the pipe with `application_speed` and `release_speed` (m/s), and the
    cylinders follow with the time constants `application_time` and `release_time` (s); the four are
    our choice, as is the radio delay. Raise ParameterError for a train that cannot be, or that is
    too stiff or too much damped for its masses to be integrated with a step of 1 ms.
    """

    name: str
    vehicles: tuple[Vehicle, ...]
    couplers: tuple[Coupler, ...]
    groups: Groups = ()
    end_of_train: EndOfTrain | None = None
    radio_delay: float = 1.0
    application_speed: float = 250.0
    release_speed: float = 160.0
    application_time: float = 4.0
    release_time: float = 8.0

    def __post_init__(self) -> None:
        Check("consist").name(self.name)
        check = Check(f"consist '{self.name}'")
        settle(self, "vehicles", check.sequence(("vehicles",), self.vehicles))
        settle(self, "couplers", check.sequence(("couplers",), self.couplers))
        if not SHORTEST <= len(self.vehicles) <= LONGEST:
            check.fail(
                ("vehicles",),
                f"a train has {SHORTEST} to {LONGEST} vehicles, not {len(self.vehicles)}",
            )
        if len(self.couplers) != len(self.vehicles) - 1:
            check.fail(
                ("couplers",),
                f"{len(self.vehicles)} vehicles have {len(self.vehicles) - 1} couplers between "
                f"them, not {len(self.couplers)}",
            )
        for index, vehicle in enumerate(self.vehicles):
            check.kind(("vehicles", index), vehicle, Vehicle)
        for index, coupler in enumerate(self.couplers):
            check.kind(("couplers", index), coupler, Coupler)
            lighter = min(self.vehicles[index : index + 2], key=lambda vehicle: vehicle.mass)
            _check_joint(check, index, coupler, lighter)
        settle(self, "groups", _groups(check, self.vehicles, self.groups))
        check.kind(("end_of_train",), self.end_of_train, EndOfTrain, type(None))
        check.within(("radio_delay",), self.radio_delay, 0.0, 60.0, "s")
        check.within(("application_speed",), self.application_speed, 10.0, 1000.0, "m/s")
        check.within(("release_speed",), self.release_speed, 10.0, 1000.0, "m/s")
        check.within(("application_time",), self.application_time, 0.05, 300.0, "s")
        check.within(("release_time",), self.release_time, 0.05, 300.0, "s")

    @property
    def size(self) -> int:
        """The number of vehicles."""
        return len(self.vehicles)

    @property
    def mass(self) -> float:
        """The mass of all vehicles in kg."""
        return sum(vehicle.mass for vehicle in self.vehicles)

    @property
    def length(self) -> float:
        """The length in m over all vehicles."""
        return sum(vehicle.length for vehicle in self.vehicles)


def neighbouring_groups(vehicles: Sequence[Vehicle]) -> Groups:
    """Return the indices of locomotives, those next to each other as one group."""
    runs = groupby(range(len(vehicles)), key=lambda index: vehicles[index].is_locomotive)
    return tuple(tuple(run) for driven, run in runs if driven)


def _check_joint(check: Check, index: int, coupler: Coupler, lighter: Vehicle) -> None:
    """Refuse a joint at which explicit steps would grow, by half of what they bear.

    Semi-implicit Euler is stable as long as h² ω² + 2 h d < 4, ω² and d the greatest eigenvalues
    of stiffness and damping over mass. In a chain they are at most 4 k/m and 4 c/m with the lighter
    neighbour's mass m. Each of the two terms may be 2 here, half of its own limit.
    """
    mass = lighter.mass
    # A gear that turns back beyond its stroke moves beside the stop.
    stiffness = coupler.gear.stiffness + coupler.gear.stop_stiffness
    for what, value, most, unit, scale in (
        ("damping", coupler.damping, mass / (4.0 * STEP), "kN·s/m", 1e-3),
        ("stiffness and stop_stiffness together", stiffness, mass / (2.0 * STEP**2), "MN/m", 1e-6),
    ):
        if value > most * (1.0 + 1e-9):
            check.fail(
                ("couplers", index),
                f"coupler {index} (from 0): {what}, {scale * value:g} {unit}, cannot be integrated "
                f"beside '{lighter.name}' of {1e-3 * mass:g} t; at most {scale * most:g} {unit}",
            )


def _groups(check: Check, vehicles: tuple[Vehicle, ...], given: Groups) -> Groups:
    """Return the groups, those of neighbours if none are given."""
    if not any(vehicle.is_locomotive for vehicle in vehicles):
        check.fail(
            ("vehicles",),
            "no vehicle is a locomotive; give one of them a traction or an electric_brake",
        )
    if not vehicles[0].is_locomotive:
        check.fail(
            ("vehicles", 0),
            f"'{vehicles[0].name}' is no locomotive; one must lead the train, since the first "
            f"group acts at its front",
        )
    groups = tuple(
        check.sequence(("groups", index), group)
        for index, group in enumerate(check.sequence(("groups",), given))
    )
    if not groups:
        return neighbouring_groups(vehicles)
    engines = [index for index, vehicle in enumerate(vehicles) if vehicle.is_locomotive]
    taken: dict[int, int] = {}
    for number, group in enumerate(groups):
        if not group:
            check.fail(("groups", number), "the group has no locomotive; leave it out")
        for position, index in enumerate(group):
            where = ("groups", number, position)
            check.whole(where, index, 0, len(vehicles) - 1)
            if not vehicles[index].is_locomotive:
                check.fail(
                    where,
                    f"vehicle {index} (from 0), '{vehicles[index].name}', is no locomotive; "
                    f"locomotives: {listing(map(str, engines))}",
                )
            if index in taken:
                check.fail(where, f"vehicle {index} is already in group {taken[index]}")
            taken[index] = number
    if taken.get(0) != 0:
        check.fail(("groups", 0), "the first group leads and must hold vehicle 0")
    missing = [index for index in engines if index not in taken]
    if missing:
        check.fail(
            ("groups",), f"vehicle {missing[0]} (from 0) is a locomotive and in no group; add it"
        )
    return groups
