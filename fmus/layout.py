"""Where each scalar of a plant stands: its value reference, and the plant as CasADi functions."""

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca

from ..models.plant import Plant
from ..models.variable import Variable

INNER_STEP = "solver.inner_step"


@dataclass(frozen=True)
class Scalar:
    """One FMI variable: element `index` of a declared variable, or a state's derivative."""

    name: str
    reference: int
    variable: Variable
    index: int
    derivative_of: int | None = None  # the state's value reference


class Layout:
    """Value references in blocks: states, derivatives, inputs, parameters, outputs, solver.

    The plant's functions take time and then every input, parameter and state, each as one
    argument in the order of `arguments`.
    """

    def __init__(self, plant: Plant) -> None:
        plant.require_complete()
        self.plant = plant
        self.states = tuple(self._scalars("state", 0))
        n = len(self.states)
        self.derivatives = tuple(
            Scalar(f"der({s.name})", n + s.reference, s.variable, s.index, s.reference)
            for s in self.states
        )
        self.first_input = 2 * n
        self.inputs = tuple(self._scalars("input", self.first_input))
        self.first_parameter = self.first_input + len(self.inputs)
        self.parameters = tuple(self._scalars("parameter", self.first_parameter))
        self.first_output = self.first_parameter + len(self.parameters)
        self.outputs = tuple(self._scalars("output", self.first_output))
        self.first_solver = self.first_output + len(self.outputs)
        self.count = self.first_solver + 1
        self.arguments = plant.variables("input", "parameter", "state")

    def _scalars(self, kind: str, first: int) -> Iterator[Scalar]:
        reference = first
        for variable in self.plant.variables(kind):  # pyright: ignore[reportArgumentType]
            for index, name in enumerate(variable.element_names):
                yield Scalar(name, reference, variable, index)
                reference += 1

    def scalars_of(self, variable: Variable) -> tuple[Scalar, ...]:
        """Return the scalars of one declared variable."""
        every = (*self.states, *self.inputs, *self.parameters, *self.outputs)
        return tuple(s for s in every if s.variable is variable)

    def _symbols(self) -> list[ca.MX]:
        return [self.plant.time, *(v.symbol for v in self.arguments)]

    def rhs(self) -> ca.Function:
        """Return the function (time, arguments…) -> derivatives of all states."""
        values = [self.plant.derivatives[v.name] for v in self.plant.variables("state")]
        return ca.Function("plant_rhs", self._symbols(), [ca.vertcat(*values)])

    def outputs_function(self) -> ca.Function:
        """Return the function (time, arguments…) -> all computed outputs."""
        values = [self.plant.outputs[v.name] for v in self.plant.variables("output")]
        return ca.Function("plant_outputs", self._symbols(), [ca.vertcat(*values)])

    def equations(self) -> ca.Function:
        """Return the function (t, x, u, p) -> (dx, y), flat vectors in value-reference order."""
        t = ca.MX.sym("t")
        x = ca.MX.sym("x", len(self.states))
        u = ca.MX.sym("u", len(self.inputs))
        p = ca.MX.sym("p", len(self.parameters))
        vectors = {"state": (x, 0), "input": (u, 0), "parameter": (p, 0)}
        pieces: list[ca.MX] = [t]
        for variable in self.arguments:
            vector, first = vectors[variable.kind]
            pieces.append(vector[first : first + variable.length])
            vectors[variable.kind] = (vector, first + variable.length)
        dx, y = self.rhs()(*pieces), self.outputs_function()(*pieces)
        return ca.Function("equations", [t, x, u, p], [dx, y], ["t", "x", "u", "p"], ["dx", "y"])

    def dependencies(self, function: ca.Function) -> list[list[int]]:
        """Return, for each row of the function's result, the value references it depends on."""
        rows: list[list[int]] = [[] for _ in range(function.size1_out(0))]
        for i, variable in enumerate(self.arguments):
            references = [s.reference for s in self.scalars_of(variable)]
            row, column = function.jac_sparsity(0, i + 1).get_triplet()
            for r, c in zip(row, column, strict=True):
                rows[r].append(references[c])
        return rows
