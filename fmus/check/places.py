"""Where an FMU's equations can be evaluated at values of one's choice.

Between steps of a co-simulation FMI 2.0 does not allow it; in initialization mode of both
interfaces it does, and in continuous-time mode of model exchange.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...base.errors import FmuError
from ...cosim.fmu.file import number_of
from .excitation import bounds
from .instance import Instance
from .subject import Subject


@dataclass
class Place:
    """An instance where `unknowns` follow from `knowns` (names), at the present values.

    `depends` gives for an unknown the knowns that the description lists for it; an unknown
    without an entry may depend on all. `limits` are the values that a known may take.
    """

    subject: Subject
    instance: Instance
    knowns: list[str]
    unknowns: list[str]
    depends: dict[str, set[str]]
    values: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.values = self.instance.read(self.knowns)

    def at(self, values: np.ndarray) -> np.ndarray:
        """Return the unknowns at these values of the knowns."""
        self.set(values)
        return self.instance.read(self.unknowns)

    def set(self, values: np.ndarray) -> None:
        """Set the knowns."""
        self.instance.write(self.knowns, values)

    def recover(self) -> None:
        """Go back to the present values, also after an error."""
        self.set(self.values)

    def is_real(self, name: str) -> bool:
        """Whether a variable is a real number."""
        return self.subject.variables[name].type == "Real"

    def is_listed(self, known: str) -> bool:
        """Whether any unknown may depend on a known, by the description."""
        return any(n not in self.depends or known in self.depends[n] for n in self.unknowns)

    def limits(self, name: str) -> tuple[float, float]:
        """Return a variable's min and max, infinite where it has none."""
        variable = self.subject.variables[name]
        if variable.type == "Boolean":
            return 0.0, 1.0
        low, high = number_of(variable, "min", -np.inf), number_of(variable, "max", np.inf)
        return float(low or 0.0), float(high or 0.0)


class Continuous(Place):
    """Model exchange in continuous-time mode: derivatives and outputs by states and inputs."""

    def __init__(self, subject: Subject, instance: Instance) -> None:
        inputs, outputs = map(subject.continuous, (subject.inputs, subject.outputs))
        listed = [*subject.description.derivatives, *subject.description.outputs]
        unknowns = list(dict.fromkeys([*subject.derivatives, *outputs]))
        super().__init__(
            subject, instance, [*subject.states, *inputs], unknowns, dependencies(listed)
        )

    def set(self, values: np.ndarray) -> None:
        """Set states and inputs."""
        n = len(self.subject.states)
        self.instance.set_states(values[:n])
        if len(self.knowns) > n:
            self.instance.write(self.knowns[n:], values[n:])


class Initial(Place):
    """Initialization mode: what is to be computed, by start values, parameters and inputs."""

    def __init__(self, subject: Subject, instance: Instance, time: float) -> None:
        knowns = [
            v.name
            for v in subject.ports
            if v.causality == "input"
            or (
                v.initial == "exact"
                and v.variability != "constant"
                and v.causality != "independent"
            )
        ]
        listed = subject.description.initialUnknowns
        numbers = {v.name for v in subject.ports}
        unknowns = [u.variable.name for u in listed if u.variable.name in numbers]
        self.time = time
        self._enter(instance)
        super().__init__(subject, instance, knowns, unknowns, dependencies(listed))

    def _enter(self, instance: Instance) -> None:
        instance.enter_initialization(self.time, None)

    def recover(self) -> None:
        """Begin initialization again, after an error too."""
        self.instance.reset()
        self._enter(self.instance)
        self.set(self.values)

    def move(self, values: np.ndarray) -> None:
        """Make these values the present ones; keep the others if the FMU refuses them."""
        try:
            if np.isfinite(self.at(values)).all():
                self.values = values
            else:
                self.set(self.values)
        except FmuError:
            self.recover()


def dependencies(listed: Sequence[Any]) -> dict[str, set[str]]:
    """Return the knowns that the description lists for unknowns; not for those without a list."""
    found: dict[str, set[str]] = {}
    for unknown in listed:
        if unknown.dependencies is not None:
            names = {v.name for v in unknown.dependencies}
            found.setdefault(unknown.variable.name, set()).update(names)
    return found


def nearby(place: Place, generator: np.random.Generator) -> np.ndarray:
    """Return random values near the present ones, within their limits; other types stay."""
    values = place.values.copy()
    for i, name in enumerate(place.knowns):
        if place.is_real(name):
            low, high = place.limits(name)
            size = place.subject.size(name, values[i])
            moved = values[i] + 0.1 * size * generator.uniform(-1.0, 1.0)
            values[i] = min(max(moved, low), high)
    return values


def elsewhere(place: Place, i: int, generator: np.random.Generator) -> float:
    """Return another value for one known, within its limits."""
    name, now = place.knowns[i], float(place.values[i])
    low, high = place.limits(name)
    if not place.is_real(name):
        low, high = bounds(place.subject.variables[name])
        return float(now + 1.0 if now + 1.0 <= high else max(now - 1.0, low))
    size = place.subject.size(name, now) * generator.uniform(0.05, 0.3)
    if now + size <= high:
        return now + size
    return max(now - size, low)
