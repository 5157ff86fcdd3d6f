"""The FMU under check: its variables by role, and instances of it."""

import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ...base.errors import FmuError
from ...cosim.fmu.file import binary_of, number_of, unit_of
from ...cosim.fmu.instance import TYPES
from ..building import EQUATIONS, VARIABLES
from .child import TIMEOUT
from .heartbeat import Heartbeat
from .instance import CO_SIMULATION, MODEL_EXCHANGE, Instance
from .watched import WatchedInstance


@dataclass(frozen=True)
class Subject:
    """An FMU and its description; `watched` names all that a run records, the outputs first.

    `timeout` (s) is what each call in a second process may take. In `heartbeat` instances say which
    call is running, where another process watches this one.
    """

    path: Path
    description: Any
    timeout: float = TIMEOUT
    heartbeat: Heartbeat | None = None

    @cached_property
    def interfaces(self) -> dict[str, Any]:
        """The interfaces that the FMU has, each with its attributes."""
        kinds = {
            CO_SIMULATION: self.description.coSimulation,
            MODEL_EXCHANGE: self.description.modelExchange,
        }
        return {kind: found for kind, found in kinds.items() if found is not None}

    def declares(self, interface: str, attribute: str) -> bool:
        """Whether an interface's capability is declared."""
        return bool(getattr(self.interfaces.get(interface), attribute, False))

    @cached_property
    def variables(self) -> dict[str, Any]:
        """All variables by name."""
        return {v.name: v for v in self.description.modelVariables}

    @cached_property
    def ports(self) -> list[Any]:
        """All variables that are numbers."""
        return [v for v in self.description.modelVariables if v.type in TYPES]

    @cached_property
    def inputs(self) -> dict[str, str | None]:
        """Inputs, each with its unit."""
        return {v.name: unit_of(v) for v in self.ports if v.causality == "input"}

    @cached_property
    def outputs(self) -> dict[str, str | None]:
        """Outputs, each with its unit."""
        return {v.name: unit_of(v) for v in self.ports if v.causality == "output"}

    @cached_property
    def derivatives(self) -> list[str]:
        """Derivatives in the order of the state vector."""
        return [u.variable.name for u in self.description.derivatives]

    @cached_property
    def states(self) -> list[str]:
        """Continuous states; none if the description does not name one for each derivative."""
        found = [u.variable.derivative for u in self.description.derivatives]
        return [] if None in found else [v.name for v in found]

    @cached_property
    def discrete(self) -> list[str]:
        """Outputs and local variables that change only at events."""
        return [
            v.name
            for v in self.ports
            if v.variability == "discrete" and v.causality in ("output", "local")
        ]

    def continuous(self, names: Iterable[str]) -> list[str]:
        """Return those that are real numbers and move continuously."""
        chosen = [self.variables[name] for name in names]
        return [v.name for v in chosen if v.type == "Real" and v.variability == "continuous"]

    @cached_property
    def markers(self) -> list[str]:
        """Discrete variables that mark events: whole numbers and truth values."""
        return [name for name in self.discrete if self.variables[name].type != "Real"]

    @cached_property
    def watched(self) -> list[str]:
        """Outputs, then local states and discrete variables."""
        return list(dict.fromkeys([*self.outputs, *self.states, *self.discrete]))

    @cached_property
    def is_ours(self) -> bool:
        """Whether the FMU carries its equations as railcosim writes them."""
        return is_ours(self.path)

    @cached_property
    def is_hybrid(self) -> bool:
        """Whether anything in it may jump, be updated from step to step, or stick by dry friction.

        Of railcosim's FMUs those with dry friction alone have no Model Exchange.
        """
        exchange = self.description.modelExchange
        steps = self.is_ours and (exchange is None or exchange.needsCompletedIntegratorStep)
        return bool(self.discrete or self.description.numberOfEventIndicators or steps)

    def size(self, name: str, value: float = 0.0) -> float:
        """Return the magnitude that a variable near `value` has: its nominal value, or 1."""
        nominal = abs(number_of(self.variables[name], "nominal") or 1.0)
        return max(abs(value), nominal)

    def instance(self, interface: str, name: str = "check", *, guid: str | None = None) -> Instance:
        """Return a fresh instance for an interface."""
        ports = list(self.inputs), self.watched
        if self.heartbeat is None:
            return Instance(self.path, interface, name, *ports, guid=guid)
        return WatchedInstance(self.heartbeat, self.path, interface, name, *ports, guid=guid)

    def require_binaries(self) -> None:
        """Raise FmuError if an interface lacks its library for this machine, or there is none."""
        if not self.interfaces:
            raise FmuError(f"{self.path} has neither co-simulation nor model exchange")
        for found in self.interfaces.values():
            binary_of(self.path, self.description, found.modelIdentifier)

    def columns(self, names: Sequence[str]) -> list[int]:
        """Return the places of names among the watched variables."""
        return [self.watched.index(name) for name in names]


def is_ours(path: Path) -> bool:
    """Return whether the FMU carries its equations as railcosim writes them."""
    with zipfile.ZipFile(path) as archive:
        return {EQUATIONS, VARIABLES} <= set(archive.namelist())
