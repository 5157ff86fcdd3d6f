"""`Plant`: variables with units and equations in CasADi, checked as they are declared."""

from collections.abc import Mapping
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Self

import casadi as ca

from ..base import units
from ..base.errors import DeclarationError, UnitError, listing, suggest
from .expressions import exact_expressions, has_nan_constant
from .variable import (
    KINDS,
    Kind,
    Number,
    Variability,
    Variable,
    check_bounds,
    check_name,
    elements,
)


class Plant:
    """A plant's declaration. Everything is declared inside a `with` block::

        with Plant("cart", description="A cart on a track") as plant:
            force = plant.input("force", unit="N")
            mass = plant.parameter("mass", 1000.0, unit="kg", minimum=1.0)
            speed = plant.state("speed", unit="m/s", output=True)
            plant.der(speed, force / mass)

    The block's end checks that every state has its equation; afterwards the plant is read-only.
    A mistake raises DeclarationError (UnitError for an unknown unit) where it is made. `stop` and
    `step` (s) are the default experiment, which tools use when they are told nothing else.
    """

    def __init__(
        self, name: str, *, description: str = "", stop: float = 10.0, step: float = 0.05
    ) -> None:
        check_name(name, f"plant '{name}'")
        if "." in name:
            raise DeclarationError(f"plant '{name}': a plant's name has no dots (it names C code)")
        for value, what in ((stop, "stop"), (step, "step")):
            if not 0.0 < value < float("inf"):
                raise DeclarationError(f"plant '{name}': {what} must be a positive time in s")
        self.name = name
        self.description = description
        self.stop = float(stop)
        self.step = float(step)
        self.time = ca.MX.sym("time")
        self._variables: dict[str, Variable] = {}
        self._derivatives: dict[str, ca.MX] = {}
        self._outputs: dict[str, ca.MX] = {}
        self._output_states: list[str] = []
        self._complete = False
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
        counts = ", ".join(f"{len(self.variables(kind))} {kind}s" for kind in KINDS)
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
        symbol = self._declare(name, "state", unit, bounds, size, "continuous", description)
        if output:
            self._output_states.append(name)
        return symbol

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
        size = None if value.is_scalar() else value.shape[0]
        bounds = (None, minimum, maximum, nominal)
        self._declare(name, "output", unit, bounds, size, "continuous", description)
        self._outputs[name] = value

    def der(self, state: Any, expression: Any) -> None:
        """Give a state's time derivative, in the state's unit per second."""
        self._open("der")
        variable = self._of_symbol(state)
        if variable is None or variable.kind != "state":
            given = f"{variable.kind} '{variable.name}'" if variable else f"'{state}'"
            raise DeclarationError(
                f"plant '{self.name}': der() needs a declared state, not {given}; "
                f"states: {listing(v.name for v in self.variables('state'))}"
            )
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

    # Reading

    def variables(self, *kinds: Kind) -> tuple[Variable, ...]:
        """Return the variables of these kinds (all without any), in the order of declaration."""
        return tuple(v for v in self._variables.values() if not kinds or v.kind in kinds)

    @property
    def output_states(self) -> tuple[str, ...]:
        """Names of the states that are outputs as well."""
        return tuple(self._output_states)

    @property
    def derivatives(self) -> Mapping[str, ca.MX]:
        """The right-hand side of each state, by its name."""
        self.require_complete()
        return self._derivatives

    @property
    def outputs(self) -> Mapping[str, ca.MX]:
        """The expression of each computed output, by its name."""
        self.require_complete()
        return self._outputs

    def require_complete(self) -> None:
        """Raise DeclarationError unless the declaration has been finished."""
        if not self._complete:
            raise DeclarationError(
                f"plant '{self.name}' is not finished: declare it inside 'with Plant(…) as plant:'"
            )

    # Checking

    def _open(self, what: str) -> None:
        if self._complete:
            raise DeclarationError(
                f"plant '{self.name}': '{what}' comes after the declaration's end; "
                "move it into the 'with' block"
            )

    def _declare(
        self,
        name: str,
        kind: Kind,
        unit: str,
        bounds: tuple[Number | None, ...],
        size: int | None,
        variability: Variability,
        description: str,
    ) -> ca.MX:
        where = f"plant '{self.name}', {kind} '{name}'"
        self._open(name)
        check_name(name, where)
        if name in self._variables or name == "time":
            other = self._variables[name].kind if name in self._variables else "the independent"
            raise DeclarationError(f"{where}: the name is taken ({other} variable)")
        try:
            units.parse(unit)
        except UnitError as error:
            raise UnitError(f"{where}: {error}") from None
        if size is not None and (type(size) is not int or size < 1):
            raise DeclarationError(f"{where}: size must be a whole number from 1, not {size!r}")
        if any(ord(c) < 32 for c in description):
            raise DeclarationError(f"{where}: the description holds a line break or control code")
        start, low, high, nominal = (elements(b, size, where) for b in bounds)
        check_bounds(where, start, low, high, nominal)
        symbol = ca.MX.sym(name, size or 1)
        self._variables[name] = Variable(
            name, kind, unit, description, size, start, low, high, nominal, variability, symbol
        )
        return symbol

    def _expression(self, expression: Any, where: str) -> ca.MX:
        where = f"plant '{self.name}', {where}"
        try:
            value = ca.densify(ca.MX(expression))
        except (NotImplementedError, TypeError, RuntimeError):
            kind = type(expression).__name__
            raise DeclarationError(f"{where}: a {kind} is not a CasADi MX expression") from None
        if value.shape[1] != 1:
            raise DeclarationError(f"{where}: shape {value.shape} is not a column vector")
        known = {v.symbol.__hash__() for v in self._variables.values()} | {self.time.__hash__()}
        for symbol in ca.symvar(value):
            if symbol.__hash__() not in known:
                hint = suggest(symbol.name(), self._variables)
                raise DeclarationError(f"{where} uses '{symbol.name()}', not declared here{hint}")
        if has_nan_constant(value):
            raise DeclarationError(
                f"{where} holds a NaN: use CasADi's functions on symbols, not math's or float()"
            )
        return value

    def _of_symbol(self, symbol: Any) -> Variable | None:
        if not isinstance(symbol, ca.MX):
            return None
        found = (v for v in self._variables.values() if ca.is_equal(v.symbol, symbol))
        return next(found, None)

    def _finish(self) -> None:
        missing = [v.name for v in self.variables("state") if v.name not in self._derivatives]
        if missing:
            raise DeclarationError(
                f"plant '{self.name}': no equation der(…) for {listing(missing)}; "
                "every state needs one"
            )
        if not self._output_states and not self._outputs:
            raise DeclarationError(
                f"plant '{self.name}' has no output; use state(…, output=True) or output(…)"
            )
        self._complete = True
