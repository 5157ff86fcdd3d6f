"""What a plant has declared so far, and the checks that every declaration passes."""

from collections.abc import Mapping
from typing import Any

import casadi as ca

from ..base import units
from ..base.errors import DeclarationError, UnitError, listing, suggest
from .event import DISCRETE, Event
from .expressions import has_nan_constant
from .variable import Kind, Number, Variability, Variable, check_bounds, check_name, elements


class Declarations:
    """Variables, equations and events by name; read-only once complete."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.time = ca.MX.sym("time")
        self._variables: dict[str, Variable] = {}
        self._by_symbol: dict[int, Variable] = {}
        self._derivatives: dict[str, ca.MX] = {}
        self._frictions: dict[str, ca.MX] = {}
        self._rates: dict[str, ca.MX] = {}
        self._outputs: dict[str, ca.MX] = {}
        self._dependents: dict[str, ca.MX] = {}
        self._updates: dict[str, ca.MX] = {}
        self._events: dict[str, Event] = {}
        self._complete = False

    # Reading

    def variables(self, *kinds: Kind) -> tuple[Variable, ...]:
        """Return the variables of these kinds (all without any), in the order of declaration."""
        return tuple(v for v in self._variables.values() if not kinds or v.kind in kinds)

    @property
    def derivatives(self) -> Mapping[str, ca.MX]:
        """The right-hand side of each state, by its name; dry friction is in it."""
        self.require_complete()
        return self._rates

    @property
    def drives(self) -> Mapping[str, ca.MX]:
        """The right-hand side of each state without its dry friction, by its name."""
        self.require_complete()
        return self._derivatives

    @property
    def frictions(self) -> Mapping[str, ca.MX]:
        """What dry friction can bear, by the name of its state, in the state's unit per second."""
        self.require_complete()
        return self._frictions

    @property
    def outputs(self) -> Mapping[str, ca.MX]:
        """The expression of each computed output, by its name."""
        self.require_complete()
        return self._outputs

    @property
    def dependents(self) -> Mapping[str, ca.MX]:
        """The expression of each dependent parameter, by its name, in parameters alone."""
        self.require_complete()
        return self._dependents

    @property
    def updates(self) -> Mapping[str, ca.MX]:
        """The value of each memory after an inner step, by its name, for those that have one."""
        self.require_complete()
        return self._updates

    @property
    def events(self) -> tuple[Event, ...]:
        """The events, in the order of declaration, which is their priority."""
        self.require_complete()
        return tuple(self._events.values())

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
        exposed: bool = False,
    ) -> ca.MX:
        where = f"plant '{self.name}', {kind} '{name}'"
        self._open(name)
        if size is not None and (type(size) is not int or size < 1):
            raise DeclarationError(f"{where}: size must be a whole number from 1, not {size!r}")
        check_name(name, where, size)
        if name in self._variables or name == "time":
            other = self._variables[name].kind if name in self._variables else "the independent"
            raise DeclarationError(f"{where}: the name is taken ({other} variable)")
        try:
            units.parse(unit)
        except UnitError as error:
            raise UnitError(f"{where}: {error}") from None
        if any(ord(c) < 32 for c in description):
            raise DeclarationError(f"{where}: the description holds a line break or control code")
        start, low, high, nominal = (elements(b, size, where) for b in bounds)
        check_bounds(where, start, low, high, nominal)
        symbol = ca.MX.sym(name, size or 1)
        variable = Variable(
            name, kind, unit, description, size, start, low, high, nominal, variability, symbol,
            exposed,
        )  # fmt: skip
        self._variables[name] = variable
        self._by_symbol[symbol.__hash__()] = variable
        return symbol

    def _expression(self, expression: Any, where: str) -> ca.MX:
        """Return a column of declared symbols; `where` says what it is for in messages."""
        where = f"plant '{self.name}', {where}"
        try:
            value = ca.densify(ca.MX(expression))
        except (NotImplementedError, TypeError, RuntimeError):
            kind = type(expression).__name__
            raise DeclarationError(f"{where}: a {kind} is not a CasADi MX expression") from None
        if value.shape[1] != 1:
            raise DeclarationError(f"{where}: shape {value.shape} is not a column vector")
        known = self._by_symbol.keys() | {self.time.__hash__()}
        for symbol in ca.symvar(value):
            if symbol.__hash__() not in known:
                hint = suggest(symbol.name(), self._variables)
                raise DeclarationError(f"{where} uses '{symbol.name()}', not declared here{hint}")
        if has_nan_constant(value):
            raise DeclarationError(
                f"{where} holds a NaN: use CasADi's functions on symbols, not math's or float()"
            )
        return value

    def _settled(self, expression: Any, where: str) -> ca.MX:
        """Return an expression that changes only at events."""
        value = self._expression(expression, where)
        for symbol in ca.symvar(value):
            variable = self._of_symbol(symbol)
            if variable is None or variable.kind not in DISCRETE:
                raise DeclarationError(
                    f"plant '{self.name}', {where} depends on '{symbol.name()}', which changes "
                    "between events; it may use modes, memories and parameters "
                    "(put the rest into the crossing)"
                )
        return value

    def _of_symbol(self, symbol: Any) -> Variable | None:
        return self._by_symbol.get(symbol.__hash__()) if isinstance(symbol, ca.MX) else None

    def _required(self, symbol: Any, kind: Kind, what: str) -> Variable:
        """Return the declared variable of one kind; raise DeclarationError for anything else."""
        variable = self._of_symbol(symbol)
        if variable is None or variable.kind != kind:
            given = f"{variable.kind} '{variable.name}'" if variable else f"'{symbol}'"
            plural = "memories" if kind == "memory" else f"{kind}s"
            raise DeclarationError(
                f"plant '{self.name}': {what} needs a declared {kind}, not {given}; "
                f"{plural}: {listing(v.name for v in self.variables(kind))}"
            )
        return variable


def with_friction(state: ca.MX, drive: ca.MX, limit: ca.MX | None) -> ca.MX:
    """Return a rate with dry friction: against the motion, or holding as far as it is needed."""
    if limit is None:
        return drive
    holding = ca.fmin(ca.fmax(drive, -limit), limit)
    return drive - ca.if_else(state == 0.0, holding, ca.sign(state) * limit)
