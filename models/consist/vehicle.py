"""A vehicle of a train as data: mass, running resistance, traction and brakes; SI units."""

from dataclasses import dataclass
from itertools import takewhile

from numpy import interp

from ..line.train import KMH
from .checks import Check, Pairs, settle

FASTEST = 720.0  # km/h; no curve goes on beyond
STANDING, ROLLING = 2.5, 5.0  # km/h, between which the starting resistance goes over; our choice
_STRONGEST = 5000.0  # kN; the strongest locomotives pull some 1500


@dataclass(frozen=True, kw_only=True)
class RunningResistance:
    """Running resistance in N/kN (‰ of the weight) with the speed V in km/h.

    It is `constant` + `linear` V + `quadratic` V², but `starting` up to 2.5 km/h, from where it
    goes over linearly to the formula until 5 km/h. The paper has the starting value up to 5 km/h,
    with a step there; that it goes over is our choice. Raise ParameterError for what cannot be.
    """

    constant: float
    linear: float
    quadratic: float
    starting: float

    def __post_init__(self) -> None:
        check = Check("running resistance")
        check.within(("constant",), self.constant, 0.0, 100.0, "N/kN")
        check.within(("linear",), self.linear, 0.0, 10.0, "N/kN per km/h")
        check.within(("quadratic",), self.quadratic, 0.0, 1.0, "N/kN per (km/h)²")
        check.within(("starting",), self.starting, 0.0, 100.0, "N/kN")

    def at(self, speed: float) -> float:
        """Return the resistance in N/kN at a speed (m/s), in either direction."""
        velocity = KMH * abs(speed)
        formula = self.constant + self.linear * velocity + self.quadratic * velocity**2
        share = min(max((velocity - STANDING) / (ROLLING - STANDING), 0.0), 1.0)
        return self.starting + share * (formula - self.starting)


@dataclass(frozen=True, kw_only=True)
class Envelope:
    """The largest force of a locomotive over its speed.

    `points` are (speed in m/s, force in N) pairs with rising speeds; linear between them, beyond
    the first and last as there. Where `power` (W) is given the force is at most power/speed. Raise
    ParameterError for a curve that cannot be.
    """

    points: Pairs
    power: float | None = None

    def __post_init__(self) -> None:
        check = Check("envelope")
        points = check.pairs(("points",), self.points)
        settle(self, "points", points)
        check.rising(("points",), [speed for speed, _ in points], 0, "km/h", KMH)
        for index, (speed, force) in enumerate(points):
            check.within(("points", index, 0), speed, 0.0, FASTEST, "km/h", KMH)
            check.within(("points", index, 1), force, 0.0, _STRONGEST, "kN", 1e-3)
        if max(force for _, force in points) < 1e3:
            check.fail(("points",), "the largest force is below 1 kN: are they in the right unit?")
        if self.power is not None:
            check.within(("power",), self.power, 10.0, 50e3, "kW", 1e-3)

    def at(self, speed: float) -> float:
        """Return the largest force in N at a speed (m/s), in either direction."""
        speed = abs(speed)
        speeds, forces = zip(*self.points, strict=True)
        force = float(interp(speed, speeds, forces))
        if self.power is None or speed * force <= self.power:
            return force
        return self.power / speed


@dataclass(frozen=True, kw_only=True)
class ShoeBrake:
    """An air brake that presses shoes on the wheels, after the heavy-haul paper's eq. (7).

    Each of the `shoes` is pressed with K = π/4 dz² pz ηz γz nz/nk: `cylinder_diameter` dz in m,
    `cylinders` nz, `rigging_ratio` γz, `efficiency` ηz, and pz = `cylinder_pressure` (Pa) times the
    service coefficient. `service` are (reduction of the brake pipe in kPa, coefficient) pairs from
    (0, 0); linear between them, beyond the last as there.

    The paper gives the equation, of which the text has lost the form: ours is the usual Chinese
    one, from memory. The coefficients are from a public page, for a pipe of 600 kPa; the other
    numbers are our choice for a C80. Raise ParameterError for what cannot be.
    """

    cylinder_diameter: float = 0.254
    cylinders: int = 1
    rigging_ratio: float = 8.4
    efficiency: float = 0.90
    shoes: int = 8
    cylinder_pressure: float = 420e3
    service: Pairs = (
        (0.0, 0.0), (50.0, 0.17), (60.0, 0.28), (70.0, 0.37), (80.0, 0.46), (90.0, 0.53),
        (100.0, 0.60), (110.0, 0.67), (120.0, 0.73), (130.0, 0.78), (140.0, 0.83), (150.0, 0.88),
        (160.0, 0.93), (170.0, 0.96),
    )  # fmt: skip

    def __post_init__(self) -> None:
        check = Check("shoe brake")
        check.within(("cylinder_diameter",), self.cylinder_diameter, 50.0, 1000.0, "mm", 1e3)
        check.whole(("cylinders",), self.cylinders, 1, 16)
        check.within(("rigging_ratio",), self.rigging_ratio, 0.5, 50.0, "")
        check.within(("efficiency",), self.efficiency, 0.1, 1.0, "")
        check.whole(("shoes",), self.shoes, 1, 64)
        check.within(("cylinder_pressure",), self.cylinder_pressure, 50.0, 1000.0, "kPa", 1e-3)
        service = check.pairs(("service",), self.service)
        settle(self, "service", service)
        if service[0] != (0.0, 0.0):
            check.fail(("service", 0), "the first pair must be 0 kPa with the coefficient 0")
        check.rising(("service",), [reduction for reduction, _ in service], 0, "kPa")
        for index, (reduction, coefficient) in enumerate(service):
            check.within(("service", index, 0), reduction, 0.0, 1000.0, "kPa")
            check.within(("service", index, 1), coefficient, 0.0, 1.0, "")
            if coefficient < service[max(index - 1, 0)][1]:
                check.fail(("service", index, 1), f"the coefficient falls to {coefficient:g}")
        if service[-1][1] == 0.0:
            check.fail(("service",), "the coefficient stays 0: the brake would never act")

    def pressure_at(self, reduction: float) -> float:
        """Return the settled cylinder pressure in Pa at a reduction of the brake pipe (kPa)."""
        reductions, coefficients = zip(*self.service, strict=True)
        return self.cylinder_pressure * float(interp(reduction, reductions, coefficients))


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """A vehicle: `mass` in kg as it runs, `length` in m between the coupling planes.

    `traction` and `electric_brake` are the largest forces of a locomotive; a vehicle with neither
    is a wagon. `brake` is its air brake, None where it has none or it is not used. A traction
    envelope must not rise with the speed; that of an electric brake may rise once, from zero. Raise
    ParameterError for a vehicle that cannot be.
    """

    name: str
    mass: float
    length: float
    resistance: RunningResistance
    brake: ShoeBrake | None = None
    traction: Envelope | None = None
    electric_brake: Envelope | None = None

    def __post_init__(self) -> None:
        Check("vehicle").name(self.name)
        check = Check(f"vehicle '{self.name}'")
        check.within(("mass",), self.mass, 2.0, 1000.0, "t", 1e-3)
        check.within(("length",), self.length, 3.0, 100.0, "m")
        check.kind(("resistance",), self.resistance, RunningResistance)
        check.kind(("brake",), self.brake, ShoeBrake, type(None))
        check.kind(("traction",), self.traction, Envelope, type(None))
        check.kind(("electric_brake",), self.electric_brake, Envelope, type(None))
        if self.traction:
            _check_falling(check, "traction", self.traction.points, 0)
        if self.electric_brake:
            points = self.electric_brake.points
            _check_falling(check, "electric_brake", points, _top(points))

    @property
    def is_locomotive(self) -> bool:
        """Whether the vehicle has traction or an electric brake."""
        return self.traction is not None or self.electric_brake is not None


def _top(points: Pairs) -> int:
    """Return where a curve that begins at zero stops to rise; 0 for any other."""
    forces = [force for _, force in points]
    top = sum(1 for _ in takewhile(lambda force: force == 0.0, forces)) - 1
    if top < 0:
        return 0
    while top + 1 < len(forces) and forces[top + 1] > forces[top]:
        top += 1
    return top


def _check_falling(check: Check, field: str, points: Pairs, start: int) -> None:
    for index in range(start + 1, len(points)):
        force, before = points[index][1], points[index - 1][1]
        if force > before:
            remedy = "it may rise only at the beginning, from 0 kN" if field != "traction" else ""
            check.fail(
                (field, "points", index, 1),
                f"{1e-3 * force:g} kN is more than the {1e-3 * before:g} kN at the lower speed; "
                f"{remedy or 'the force must not rise with the speed'}",
            )
