"""Where each scalar of a plant stands: its value reference."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from ..models.plant import Plant
from ..models.solver import Solver
from ..models.variable import Kind, Variable

SOLVER = "solver."


@dataclass(frozen=True)
class Scalar:
    """One FMI variable: element `index` of a declared variable, or a state's derivative."""

    name: str
    reference: int
    variable: Variable
    index: int
    derivative_of: int | None = None  # the state's value reference

    @property
    def is_computed(self) -> bool:
        """Whether the FMU computes it: a derivative, output or dependent parameter."""
        return self.derivative_of is not None or self.variable.kind in ("output", "dependent")


class Layout:
    """Value references in blocks, and the solver with its parameters.

    The blocks are states, derivatives, inputs, parameters, dependents, discrete (modes, then
    memories), outputs, and the solver's parameters.
    """

    def __init__(self, plant: Plant, solver: Solver | None = None) -> None:
        plant.require_complete()
        self.plant = plant
        self.solver = plant.solver if solver is None else solver
        plant.check_solver(self.solver)
        self._count = 0
        self.states = self._scalars("state")
        n = len(self.states)
        self.derivatives = tuple(
            Scalar(f"der({s.name})", n + s.reference, s.variable, s.index, s.reference)
            for s in self.states
        )
        self._count += n
        self.first_input = self._count
        self.inputs = self._scalars("input")
        self.first_parameter = self._count
        self.parameters = self._scalars("parameter")
        self.first_dependent = self._count
        self.dependents = self._scalars("dependent")
        self.first_discrete = self._count
        self.discrete = (*self._scalars("mode"), *self._scalars("memory"))
        self.first_output = self._count
        self.outputs = self._scalars("output")
        self.first_solver = self._count
        self.settings = {
            name: (self.first_solver + i, value)
            for i, (name, value) in enumerate(self.solver.settings.items())
        }
        self.count = self._count + len(self.settings)

    def _scalars(self, kind: Kind) -> tuple[Scalar, ...]:
        made = tuple(self._numbered(kind))
        self._count += len(made)
        return made

    def _numbered(self, kind: Kind) -> Iterator[Scalar]:
        reference = self._count
        for variable in self.plant.variables(kind):
            for index, name in enumerate(variable.element_names):
                yield Scalar(name, reference, variable, index)
                reference += 1

    @cached_property
    def _by_variable(self) -> dict[str, list[Scalar]]:
        found: dict[str, list[Scalar]] = {}
        for scalar in self.scalars:
            if scalar.derivative_of is None:
                found.setdefault(scalar.variable.name, []).append(scalar)
        return found

    @property
    def scalars(self) -> tuple[Scalar, ...]:
        """All scalars but the solver's parameters, in value-reference order."""
        return (
            *self.states, *self.derivatives, *self.inputs, *self.parameters, *self.dependents,
            *self.discrete, *self.outputs,
        )  # fmt: skip

    @property
    def exposed(self) -> tuple[Scalar, ...]:
        """States, modes and memories that are outputs as well."""
        return tuple(s for s in (*self.states, *self.discrete) if s.variable.exposed)

    def scalars_of(self, name: str) -> list[Scalar]:
        """Return the scalars of one declared variable."""
        return self._by_variable[name]
