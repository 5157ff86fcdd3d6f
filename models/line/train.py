"""A train as data: masses, running resistance, traction and brake limits."""

import math
from dataclasses import dataclass, fields
from itertools import pairwise

from numpy import interp

from ...base.errors import ParameterError

GRAVITY = 9.80665  # m/s², standard gravity
KMH = 3.6  # km/h in 1 m/s


@dataclass(frozen=True, kw_only=True)
class Davis:
    """Running resistance in N/kN (‰ of the weight): a + b V + c V² with the speed V in km/h."""

    a: float
    b: float
    c: float

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0.0 <= value < math.inf:
                raise ParameterError(f"Davis: {field.name} must not be negative, but is {value}")

    def at(self, speed: float) -> float:
        """Return the resistance in N/kN at a speed (m/s, not negative)."""
        velocity = KMH * speed
        return self.a + self.b * velocity + self.c * velocity**2

    def force(self, speed: float, mass: float) -> float:
        """Return the resistance in N at a speed (m/s, not negative) for a mass (kg)."""
        return self.at(speed) * mass * GRAVITY / 1000.0

    @classmethod
    def from_force(cls, a: float, b: float, c: float, *, mass: float) -> "Davis":
        """Return the coefficients for a force a + b v + c v² in N, v in m/s, of a mass (kg)."""
        return cls.from_acceleration(a / mass, b / mass, c / mass)

    @classmethod
    def from_acceleration(cls, a: float, b: float, c: float) -> "Davis":
        """Return the coefficients for a deceleration a + b v + c v² in m/s², v in m/s."""
        scale = 1000.0 / GRAVITY
        return cls(a=scale * a, b=scale * b / KMH, c=scale * c / KMH**2)


@dataclass(frozen=True, kw_only=True)
class Train:
    """A train: masses in kg, length in m, forces in N, power in W, m/s and m/s² (positive).

    `mass` is what a run is computed with when no load is named; `mass_empty`, `mass_loaded` and
    `mass_crush` are the loads AW0, AW2 and AW3 (empty, nominal and crush load). The effective
    inertia is the mass times `rotating_mass_factor`. `traction_curve` are (speed, force) pairs with
    rising speeds, where a force and a power do not tell enough; empty else. `description` says
    where the data come from. Raise ParameterError for data that cannot be.
    """

    name: str
    mass: float
    mass_empty: float
    mass_loaded: float
    mass_crush: float
    length: float
    davis: Davis
    max_traction_force: float
    max_power: float
    max_speed: float
    service_deceleration: float
    emergency_deceleration: float
    rotating_mass_factor: float = 1.0
    traction_curve: tuple[tuple[float, float], ...] = ()
    description: str = ""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float | int) and not 0.0 < value < math.inf:
                raise ParameterError(
                    f"train '{self.name}': {field.name} must be positive and finite, not {value}"
                )
        speeds = [speed for speed, _ in self.traction_curve]
        if any(later <= earlier for earlier, later in pairwise(speeds)):
            raise ParameterError(f"train '{self.name}': the traction curve's speeds must rise")
        masses = (self.mass_empty, self.mass_loaded, self.mass_crush)
        if list(masses) != sorted(masses) or not masses[0] <= self.mass <= masses[2]:
            raise ParameterError(
                f"train '{self.name}': the masses must rise from empty over loaded to crush, with "
                f"mass within them, but are {masses} and {self.mass} kg"
            )
        if self.rotating_mass_factor < 1.0:
            raise ParameterError(
                f"train '{self.name}': rotating_mass_factor is at least 1, not "
                f"{self.rotating_mass_factor}"
            )
        if self.emergency_deceleration < self.service_deceleration:
            raise ParameterError(
                f"train '{self.name}': the emergency brake ({self.emergency_deceleration} m/s²) is "
                f"weaker than the service brake ({self.service_deceleration} m/s²)"
            )

    def mass_at(self, load: str) -> float:
        """Return the mass in kg at a load: "AW0", "AW2" or "AW3"."""
        loads = {"AW0": self.mass_empty, "AW2": self.mass_loaded, "AW3": self.mass_crush}
        if load not in loads:
            raise ParameterError(f"no load '{load}'; loads: {', '.join(loads)}")
        return loads[load]

    def traction_force(self, speed: float) -> float:
        """Return the largest traction force in N at a speed (m/s).

        Force-limited, then power-limited, and with a `traction_curve` not above it (linear between
        its points, beyond its ends as there).
        """
        force = min(self.max_traction_force, self.max_power / max(speed, 1e-9))
        if not self.traction_curve:
            return force
        speeds, forces = zip(*self.traction_curve, strict=True)
        return min(force, float(interp(speed, speeds, forces)))
