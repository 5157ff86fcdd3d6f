"""A plant as CasADi functions: those that become C, and its equations on flat vectors."""

from collections.abc import Sequence
from functools import cached_property

import casadi as ca
import numpy as np

from ..models.expressions import exact_expressions
from ..models.solver import Rodas, SemiImplicitEuler
from ..models.variable import Kind
from .evaluation import Evaluation, write_evaluation
from .layout import Layout

_FLAT: dict[str, tuple[Kind, ...]] = {
    "x": ("state",), "u": ("input",), "p": ("parameter",), "d": ("mode", "memory"),
}  # fmt: skip


class Functions:
    """The plant's functions of (time, arguments…), each with one column as its result.

    The arguments are every input, parameter, dependent, state, mode and memory, each as one
    argument in the order of `arguments`.
    """

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.plant = plant = layout.plant
        self.arguments = plant.variables(
            "input", "parameter", "dependent", "state", "mode", "memory"
        )
        self._symbols = [plant.time, *(v.symbol for v in self.arguments)]

    def _function(self, name: str, values: Sequence[ca.MX]) -> ca.Function:
        return ca.Function(name, self._symbols, [ca.vertcat(ca.MX(0, 1), *values)])

    @cached_property
    def rhs(self) -> ca.Function:
        """The derivatives of all states."""
        plant = self.plant
        return self._function(
            "plant_rhs", [plant.derivatives[v.name] for v in plant.variables("state")]
        )

    @cached_property
    def outputs(self) -> ca.Function:
        """All computed outputs."""
        plant = self.plant
        return self._function(
            "plant_outputs", [plant.outputs[v.name] for v in plant.variables("output")]
        )

    @cached_property
    def dependents(self) -> ca.Function:
        """All dependent parameters."""
        return self._function("plant_dependents", list(self.plant.dependents.values()))

    @cached_property
    def events(self) -> dict[str, ca.Function]:
        """Crossings, times and guards, where there are any; state events come first."""
        groups = self.plant.events
        states = [e for e in groups if e.kind == "state"]
        times = [e for e in groups if e.kind == "time"]
        found = {}
        if states:
            found["plant_crossings"] = [e.expression for e in states]
        if times:
            found["plant_times"] = [e.expression for e in times]
        if groups:
            found["plant_guards"] = [e.guard for e in (*states, *times)]
        return {name: self._function(name, values) for name, values in found.items()}

    @cached_property
    def crossing_rates(self) -> dict[str, ca.Function]:
        """For each state event the derivatives of its crossings, called as CasADi's `forward(1)`.

        They are along time, states and inputs: the seeds of all others count as zero.
        """
        found = {}
        for i, event in enumerate(self.plant.events):
            if event.kind == "state":
                along = self._function(f"plant_crossing{i}", [event.expression]).forward(1)
                symbols = along.mx_in()
                seeds = symbols[-len(self._symbols) :]
                for k, variable in enumerate(self.arguments, start=1):
                    if variable.kind not in ("state", "input"):
                        seeds[k] = ca.MX(*seeds[k].shape)
                given = [*symbols[: -len(self._symbols)], *seeds]
                (rate,) = along.call(given, True, False)
                name = f"plant_crossing_rate{i}"
                found[event.name] = ca.Function(name, symbols, [ca.densify(rate)])
        return found

    @cached_property
    def changes(self) -> list[ca.Function]:
        """For each event, the new values of all that it changes."""
        return [
            self._function(f"plant_change{i}", list(e.changes.values()))
            for i, e in enumerate(self.plant.events)
        ]

    @cached_property
    def update(self) -> ca.Function:
        """The memories' values after an inner step, of those that have an update."""
        return self._function("plant_update", list(self.plant.updates.values()))

    def _of_solver(self) -> list[ca.Function]:
        solver = self.layout.solver
        if isinstance(solver, SemiImplicitEuler):
            return [self._step(solver)]
        if isinstance(solver, Rodas):
            return [self._jacobian()]
        return []

    def _step(self, solver: SemiImplicitEuler) -> ca.Function:
        """Return the states after a step of semi-implicit Euler; it is given two things more.

        They are the step's length h and the inputs at its end. First come the other states, then
        the positions with the others' new values. Dry friction is taken implicitly (Moreau's
        time-stepping scheme): it takes from a state's new value what it can bear in the step, and
        no more than brings it to exactly zero.
        """
        plant, h = self.plant, ca.MX.sym("h")
        at_end = {v.name: ca.MX.sym(f"{v.name} at the end", v.length)
                  for v in self.arguments if v.kind == "input"}  # fmt: skip
        states = plant.variables("state")
        new = dict(at_end)
        for v in states:
            if v.name not in solver.positions:
                new[v.name] = v.symbol + h * plant.drives[v.name]
                if v.name in plant.frictions:
                    most = h * plant.frictions[v.name]
                    new[v.name] -= ca.fmin(ca.fmax(new[v.name], -most), most)
        positions = [v for v in states if v.name in solver.positions]
        rates = self._function("rates", [plant.drives[v.name] for v in positions])
        given = [plant.time + h, *(new.get(v.name, v.symbol) for v in self.arguments)]
        (rate,) = rates.call(given, True, False)
        ends = np.cumsum([0, *(v.length for v in positions)])
        for v, first, last in zip(positions, ends, ends[1:], strict=False):
            new[v.name] = v.symbol + h * rate[int(first) : int(last)]
        result = ca.vertcat(*(new[v.name] for v in states))
        return ca.Function("plant_step", [*self._symbols, h, *at_end.values()], [result])

    def _jacobian(self) -> ca.Function:
        """Return ∂f/∂x as a full matrix: a Rosenbrock method needs it exactly."""
        flat = ca.MX.sym("x", len(self.layout.states))
        pieces, first = list(self._symbols), 0
        for i, variable in enumerate(self.arguments, start=1):
            if variable.kind == "state":
                pieces[i] = flat[first : first + variable.length]
                first += variable.length
        matrix = ca.Function(
            "jacobian_of_states",
            [*self._symbols, flat],
            [ca.jacobian(self.rhs(*pieces), flat)],
        )
        states = ca.vertcat(ca.MX(0, 1), *(v.symbol for v in self.arguments if v.kind == "state"))
        return ca.Function(
            "plant_jacobian", self._symbols, [ca.densify(matrix(*self._symbols, states))]
        )

    @cached_property
    def evaluation(self) -> Evaluation:
        """The C of all functions that the FMU evaluates, and of their directional derivatives."""
        with exact_expressions():
            found = [self.rhs, self.outputs, *self.events.values(), *self.changes]
            found += self._of_solver()
            if self.layout.dependents:
                found.append(self.dependents)
            if self.plant.updates:
                found.append(self.update)
            names = ("plant_rhs", "plant_outputs", "plant_dependents")
            derivatives = [f.forward(1) for f in found if f.name() in names]
            derivatives += self.crossing_rates.values()
        return write_evaluation(self.layout, self.arguments, found, derivatives)

    @cached_property
    def equations(self) -> ca.Function:
        """The function (t, x, u, p, d) -> (dx, y) on flat vectors in value-reference order."""
        t = ca.MX.sym("t")
        flat = {
            key: ca.MX.sym(key, sum(v.length for v in self.plant.variables(*kinds)))
            for key, kinds in _FLAT.items()
        }
        values: dict[str, ca.MX] = {}
        for key, kinds in _FLAT.items():
            first = 0
            for variable in (v for kind in kinds for v in self.plant.variables(kind)):
                values[variable.name] = flat[key][first : first + variable.length]
                first += variable.length
        known = [v.symbol for v in self.arguments if v.kind == "parameter"]
        given = [values[s.name()] for s in known]
        for name, expression in self.plant.dependents.items():
            values[name] = ca.substitute([expression], known, given)[0]
        pieces = [t, *(values[v.name] for v in self.arguments)]
        dx, y = self.rhs(*pieces), self.outputs(*pieces)
        names = (["t", *flat], ["dx", "y"])
        return ca.Function("equations", [t, *flat.values()], [dx, y], *names)

    def dependencies(self, function: ca.Function) -> list[list[int]]:
        """Return, for each row of a function's result, the value references it depends on.

        A dependent parameter counts as the parameters that it is made of.
        """
        rows: list[set[int]] = [set() for _ in range(function.size1_out(0))]
        for i, variable in enumerate(self.arguments):
            references = [s.reference for s in self.layout.scalars_of(variable.name)]
            row, column = function.jac_sparsity(0, i + 1).get_triplet()
            for r, c in zip(row, column, strict=True):
                rows[r].add(references[c])
        first = self.layout.first_dependent
        last = self.layout.first_discrete
        if first < last and function is not self.dependents:
            made_of = self.dependencies(self.dependents)
            for row in rows:
                for reference in [r for r in row if first <= r < last]:
                    row.remove(reference)
                    row.update(made_of[reference - first])
        return [sorted(row) for row in rows]
