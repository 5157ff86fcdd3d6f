"""`Plant`: variables with units, equations and events in CasADi, checked as they are declared."""

from collections.abc import Iterable
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Self

import casadi as ca

from ..base.errors import DeclarationError, listing
from .declarations import with_friction
from .event import sized
from .event_declarations import EventDeclarations
from .expressions import exact_expressions
from .solver import RungeKutta4, SemiImplicitEuler, Solver
from .variable import KINDS, Number, check_name

_PARAMETERS = ("parameter", "dependent")
_LARGEST = 2**31  # FMI's integers have 32 bits


class Plant(EventDeclarations):
    """A plant's declaration. Everything is declared inside a `with` block::

        with Plant("cart", description="A cart on a track") as plant:
            force = plant.input("force", unit="N")
            mass = plant.parameter("mass", 1000.0, unit="kg", minimum=1.0)
            speed = plant.state("speed", unit="m/s", output=True)
            plant.der(speed, force / mass)

    The block's end checks that every state has its equation; afterwards the plant is read-only.
    A mistake raises DeclarationError (UnitError for an unknown unit) where it is made. `stop` and
    `step` (s) are the default experiment, which tools use when they are told nothing else.
    `solver` is the solver inside its co-simulation FMU.
    """

    def __init__(
        self,
        name: str,
        *,
        description: str = "",
        stop: float = 10.0,
        step: float = 0.05,
        solver: Solver | None = None,
    ) -> None:
        check_name(name, f"plant '{name}'")
        if "." in name:
            raise DeclarationError(f"plant '{name}': a plant's name has no dots (it names C code)")
        for value, what in ((stop, "stop"), (step, "step")):
            if not 0.0 < value < float("inf"):
                raise DeclarationError(f"plant '{name}': {what} must be a positive time in s")
        super().__init__(name)
        self.description = description
        self.stop = float(stop)
        self.step = float(step)
        self.solver = RungeKutta4() if solver is None else solver
        self._exact = ExitStack()

    def __enter__(self) -> Self:
        # Not simplified, so that the C does what is written, operation by operation.
        self._exact.enter_context(exact_expressions())
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._exact.close()
        if kind is None:
            self._finish()

    def __repr__(self) -> str:
        found = {kind: len(self.variables(kind)) for kind in KINDS}
        plurals = {"memory": "memories"}
        counts = ", ".join(f"{n} {plurals.get(k, k + 's')}" for k, n in found.items() if n)
        return f"Plant({self.name!r}: {counts})"

    # Declaring

    def input(
        self,
        name: str,
        *,
        unit: str,
        start: Number = 0.0,
        minimum: Number | None = None,
        maximum: Number | None = None,
        nominal: Number | None = None,
        size: int | None = None,
        description: str = "",
    ) -> Any:
        """Declare an input and return its symbol; `start` is its value until it is first set."""
        bounds = (start, minimum, maximum, nominal)
        return self._declare(name, "input", unit, bounds, size, "continuous", description)

    def parameter(
        self,
        name: str,
        value: Number,
        *,
        unit: str,
        minimum: Number | None = None,
        maximum: Number | None = None,
        nominal: Number | None = None,
        size: int | None = None,
        tunable: bool = False,
        description: str = "",
    ) -> Any:
        """Declare a parameter and return its symbol.

        A fixed parameter is set before the run; a tunable one also between steps.
        """
        bounds = (value, minimum, maximum, nominal)
        variability = "tunable" if tunable else "fixed"
        return self._declare(name, "parameter", unit, bounds, size, variability, description)

    def state(
        self,
        name: str,
        *,
        unit: str,
        start: Number = 0.0,
        minimum: Number | None = None,
        maximum: Number | None = None,
        nominal: Number | None = None,
        size: int | None = None,
        output: bool = False,
        description: str = "",
    ) -> Any:
        """Declare a continuous state and return its symbol; `output=True` makes it a port too."""
        bounds = (start, minimum, maximum, nominal)
        return self._declare(name, "state", unit, bounds, size, "continuous", description, output)

    def dependent(self, name: str, expression: Any, *, unit: str, description: str = "") -> Any:
        """Declare a dependent parameter, computed from parameters, and return its symbol.

        It is computed when a parameter is set, not at every step. It may use parameters and
        dependents declared before it.
        """
        where = f"dependent '{name}'"
        value = self._expression(expression, where)
        used = [self._of_symbol(s) for s in ca.symvar(value)]
        wrong = [v.name if v else "time" for v in used if v is None or v.kind not in _PARAMETERS]
        if wrong:
            raise DeclarationError(
                f"plant '{self.name}', {where} depends on '{wrong[0]}'; only parameters are allowed"
            )
        earlier = [v for v in used if v is not None and v.kind == "dependent"]
        # In parameters alone, so that one function of the parameters computes all of them.
        value = ca.substitute(
            [value], [v.symbol for v in earlier], [self._dependents[v.name] for v in earlier]
        )[0]
        size = None if value.is_scalar() else value.shape[0]
        tunable = any(v is not None and v.variability == "tunable" for v in used)
        variability = "tunable" if tunable else "fixed"
        none = (None, None, None, None)
        symbol = self._declare(name, "dependent", unit, none, size, variability, description)
        self._dependents[name] = value
        return symbol

    def mode(
        self,
        name: str,
        *,
        start: int | Iterable[int] = 0,
        minimum: int | None = None,
        maximum: int | None = None,
        size: int | None = None,
        output: bool = False,
        description: str = "",
    ) -> Any:
        """Declare an integer that changes only at events, and return its symbol."""
        bounds = (start, minimum, maximum, None)
        symbol = self._declare(name, "mode", "1", bounds, size, "discrete", description, output)
        variable = self._variables[name]
        for numbers in (variable.start, variable.minimum, variable.maximum):
            if any(n != int(n) or abs(n) >= _LARGEST for n in numbers or ()):
                del self._variables[name]
                raise DeclarationError(f"plant '{self.name}', mode '{name}': modes are integers")
        return symbol

    def memory(
        self,
        name: str,
        *,
        unit: str,
        start: Number = 0.0,
        minimum: Number | None = None,
        maximum: Number | None = None,
        nominal: Number | None = None,
        size: int | None = None,
        output: bool = False,
        description: str = "",
    ) -> Any:
        """Declare a stored real and return its symbol.

        It changes at events, and after inner steps if it has an `update`; it is held in between.
        """
        bounds = (start, minimum, maximum, nominal)
        return self._declare(name, "memory", unit, bounds, size, "discrete", description, output)

    def output(
        self,
        name: str,
        expression: Any,
        *,
        unit: str,
        minimum: Number | None = None,
        maximum: Number | None = None,
        nominal: Number | None = None,
        description: str = "",
    ) -> None:
        """Declare an output computed from time, inputs, parameters and states."""
        value = self._expression(expression, f"output '{name}'")
        size = None if value.is_scalar() and "[]" not in name else value.shape[0]
        bounds = (None, minimum, maximum, nominal)
        self._declare(name, "output", unit, bounds, size, "continuous", description)
        self._outputs[name] = value

    def der(self, state: Any, expression: Any) -> None:
        """Give a state's time derivative, in the state's unit per second."""
        self._open("der")
        variable = self._required(state, "state", "der()")
        if variable.name in self._derivatives:
            raise DeclarationError(
                f"plant '{self.name}': der({variable.name}) is given twice; keep one equation"
            )
        value = self._expression(expression, f"der({variable.name})")
        if value.is_scalar() and variable.length > 1:
            value = ca.repmat(value, variable.length, 1)
        if value.shape != (variable.length, 1):
            raise DeclarationError(
                f"plant '{self.name}': der({variable.name}) has {value.shape[0]} elements, "
                f"the state has {variable.length}"
            )
        self._derivatives[variable.name] = value

    def friction(self, state: Any, limit: Any) -> None:
        """Let dry friction act on a state, at most `limit`, in the state's unit per second.

        It opposes the state's motion, and holds it at exactly zero for as long as what drives it
        (its `der`) does not exceed the limit. No events are needed, so that thousands of states
        may have it; but only SemiImplicitEuler carries it (Moreau's time-stepping scheme, which
        takes friction implicitly), and such a plant has no Model Exchange. A limit below zero
        counts as zero.
        """
        self._open("friction")
        variable = self._required(state, "state", "friction()")
        if variable.name in self._frictions:
            raise DeclarationError(f"plant '{self.name}': friction({variable.name}) is given twice")
        what = f"friction({variable.name})"
        value = ca.fmax(0.0, self._expression(limit, what))  # in this order: see fmus/evaluation.py
        where = f"plant '{self.name}', {what}"
        self._frictions[variable.name] = sized(value, variable.length, where)

    # Finishing

    def _finish(self) -> None:
        missing = [v.name for v in self.variables("state") if v.name not in self._derivatives]
        if missing:
            raise DeclarationError(
                f"plant '{self.name}': no equation der(…) for {listing(missing)}; "
                "every state needs one"
            )
        if not self._outputs and not any(v.exposed for v in self.variables()):
            raise DeclarationError(
                f"plant '{self.name}' has no output; use state(…, output=True) or output(…)"
            )
        self.check_solver(self.solver)
        self._rates = {
            name: with_friction(self._variables[name].symbol, drive, self._frictions.get(name))
            for name, drive in self._derivatives.items()
        }
        self._complete = True

    def check_solver(self, solver: Solver) -> None:
        """Raise DeclarationError if a solver does not fit the plant."""
        if not isinstance(solver, Solver):
            raise DeclarationError(
                f"plant '{self.name}': the solver must be RungeKutta4(…), SemiImplicitEuler(…), "
                f"DormandPrince(…) or Rodas(…) of railcosim.models, not {solver!r}"
            )
        if not isinstance(solver, SemiImplicitEuler):
            if self._frictions:
                raise DeclarationError(
                    f"plant '{self.name}': dry friction({next(iter(self._frictions))}) needs the "
                    "solver SemiImplicitEuler(…); with others declare events, see models/rolling.py"
                )
            return
        held = [name for name in self._frictions if name in solver.positions]
        if held:
            raise DeclarationError(
                f"plant '{self.name}': '{held[0]}' has dry friction, so it is no position of "
                "SemiImplicitEuler"
            )
        states = [v.name for v in self.variables("state")]
        unknown = [name for name in solver.positions if name not in states]
        if unknown or not solver.positions:
            raise DeclarationError(
                f"plant '{self.name}': SemiImplicitEuler's positions must be states, not "
                f"{listing(unknown)}; states: {listing(states)}"
            )
