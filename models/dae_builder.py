"""`plant_of`: a `casadi.DaeBuilder` as a `Plant`, so that it can be exported like one."""

import math
import re
from dataclasses import replace
from typing import Any

import casadi as ca

from ..base.errors import DeclarationError
from .dae_equations import definitions, where
from .dae_events import When, check_start, declare_event, when_equations
from .plant import Plant
from .solver import DormandPrince, Solver
from .variable import check_name

_REAL = ("Float64", "Float32")
_WHOLE = ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Boolean")
_STATES = ("x", "q")  # a quadrature state is a state that no equation uses


def plant_of(dae: ca.DaeBuilder, *, solver: Solver | None = None) -> Plant:
    """Return the plant that a DaeBuilder describes; the DaeBuilder is only read.

    Inputs u, fixed and tunable parameters, states x and q, discrete variables and outputs y keep
    their names; constants, dependent variables w and explicit algebraic variables z are
    substituted out. When-equations become events. Without any output every state is one. An
    empty unit is "1". `solver` is the FMU's solver; without one, a tolerance of the default
    experiment makes it `DormandPrince` with that relative tolerance. Raise DeclarationError,
    naming variable and remedy, for what a plant cannot express; UnitError for an unknown unit.
    """
    if not isinstance(dae, ca.DaeBuilder) or dae.is_null():
        raise DeclarationError(f"plant_of takes a casadi.DaeBuilder with a model, not {dae!r}")
    if not hasattr(dae, "symbolic"):
        raise DeclarationError(
            f"{where(dae)}: DaeBuilders are read from CasADi 3.8 on, this is "
            f"{ca.CasadiMeta.version()}; pip install -U casadi"
        )
    if not dae.symbolic():
        raise DeclarationError(
            f"{where(dae)} was loaded from an FMU and has no equations to export; "
            "use the FMU itself"
        )
    if solver is None and not math.isnan(dae.tolerance()):
        solver = DormandPrince(relative_tolerance=dae.tolerance())
    _check_visible(dae, dae.name())
    with Plant(dae.name(), solver=solver, **_experiment(dae)) as plant:
        _Translation(dae, plant).run()
    check_start(dae, plant)
    return plant


def _experiment(dae: ca.DaeBuilder) -> dict[str, Any]:
    """Return the default experiment's times in s, as far as they are given."""
    if not (math.isnan(dae.start_time()) or dae.start_time() == 0.0):
        raise DeclarationError(
            f"{where(dae)}: the default experiment starts at {dae.start_time():g} s, a plant's "
            "at 0; use dae.set_start_time(0) and choose the start in the simulating tool"
        )
    times = {"stop": dae.stop_time(), "step": dae.step_size()}
    return {name: time for name, time in times.items() if not math.isnan(time)}


def _check_visible(dae: ca.DaeBuilder, name: str, size: int | None = None) -> None:
    """Raise DeclarationError for a name that an FMU cannot have."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    remedy = f"call it '_{plain}'" if plain[:1].isdigit() else f"call it '{plain}'"
    if "[" in name:
        remedy = "declare one vector with the option dimension=[n]; its elements get the indices"
    elif name.startswith("der("):
        remedy = f"give it an output with a name of its own: dae.eq(rate, dae.{name})"
    try:
        check_name(name, f"{where(dae)}: '{name}'", size)
    except DeclarationError as error:
        raise DeclarationError(f"{error}; {remedy}") from None


class _Translation:
    """A DaeBuilder on its way into a plant."""

    def __init__(self, dae: ca.DaeBuilder, plant: Plant) -> None:
        self.dae = dae
        self.plant = plant
        self.definitions = definitions(dae)
        self.outputs = dict(zip(dae.y(), dae.outputs("y"), strict=True))
        self.started: dict[str, list[float]] = {}
        # A DaeBuilder's symbol, by its hash -> what stands for it in the plant.
        self.known: dict[int, ca.MX] = {}

    def run(self) -> None:
        """Declare everything; the order is the plant's order of variables."""
        if not self.outputs and not [*self.dae.x(), *self.dae.q()]:
            raise DeclarationError(
                f"{where(self.dae)} has neither outputs nor states; "
                "declare an output with dae.add(name, 'output')"
            )
        self._constants()
        self._initial()
        for name in self.dae.u():
            self._input(name)
        for name in [n for n in self.dae.all() if self._category(n) in ("c", "p")]:
            self._parameter(name)
        for name in [*self.dae.x(), *self.dae.q()]:
            self._state(name)
        for name, one in self.definitions.items():
            self._definition(name, one.expression)
        for name, rate in self._rates().items():
            self.plant.der(self.known[self.dae.var(name).__hash__()], self._of(rate))
        for when in when_equations(self.dae):
            self._event(when)
        for name, expression in self.outputs.items():
            self._output(name, expression)

    # Reading

    def _category(self, name: str) -> str:
        return self.dae.category(name)

    def _of(self, expression: ca.MX) -> ca.MX:
        """Return an expression in the plant's symbols."""
        used = [s for s in ca.symvar(expression) if s.__hash__() in self.known]
        if not used:
            return expression
        return ca.substitute([expression], used, [self.known[s.__hash__()] for s in used])[0]

    def _refuse(self, name: str, message: str) -> DeclarationError:
        return DeclarationError(f"{where(self.dae)}: '{name}' {message}")

    def _size(self, name: str) -> int | None:
        dimension = self.dae.dimension(name)
        if len([n for n in dimension if n != 1]) > 1:
            shape = " × ".join(str(n) for n in dimension)
            raise self._refuse(
                name, f"is a matrix ({shape}); plants have scalars and vectors: one for each column"
            )
        return None if self.dae.numel(name) == 1 else self.dae.numel(name)

    def _attributes(self, name: str) -> dict[str, Any]:
        """Return what Plant's declarations have in common; infinite bounds are none."""
        _check_visible(self.dae, name, self._size(name))
        low, high = self.dae.min(name), self.dae.max(name)
        nominal = self.dae.nominal(name)
        return {
            "unit": self.dae.unit(name) or "1",
            "minimum": None if low == -math.inf else low,
            "maximum": None if high == math.inf else high,
            "nominal": None if nominal == 1.0 else nominal,
            "description": self.dae.description(name),
        }

    def _real(self, name: str, what: str) -> None:
        """Raise DeclarationError unless a variable is of a floating-point type."""
        if self.dae.type(name) not in _REAL:
            raise self._refuse(
                name, f"is of type {self.dae.type(name)}; a plant's {what} are real: use Float64"
            )

    def _start(self, name: str) -> list[float]:
        """Return the start attribute, which the current value must not contradict."""
        if name in self.started:
            return self.started[name]
        start = list(self.dae.start(name))
        value = self._value(name)
        if not any(math.isnan(v) for v in value) and value != start:
            raise self._refuse(
                name,
                f"has the start {start} (add, set_start) but the value {value} (add, set); make "
                "them agree with dae.set_start(…) or dae.set(…)",
            )
        return start

    def _value(self, name: str) -> list[float]:
        return list(self.dae.attribute("value", [name]))

    def _fixed(self, name: str) -> list[float]:
        """Return a constant's value, which CasADi takes from `set`, or its start attribute."""
        value, start = self._value(name), list(self.dae.start(name))
        if not any(math.isnan(v) for v in value):
            return value
        if not any(start):
            raise self._refuse(name, f"has no value; set it with dae.set('{name}', …)")
        return start

    # Declaring

    def _declared(self, name: str, symbol: ca.MX) -> None:
        self.known[self.dae.var(name).__hash__()] = symbol

    def _constants(self) -> None:
        """Replace constants by their values, and find the time."""
        hidden = self.dae.has("time") and self.dae.causality("time") == "independent"
        for name in [*self.dae.t_new(), *(["time"] if hidden else [])]:
            self._declared(name, self.plant.time)
        for name in self.dae.c():
            if self.dae.type(name) not in (*_REAL, *_WHOLE):
                raise self._refuse(name, f"is of type {self.dae.type(name)}; leave it out")
            if self.dae.causality(name) != "parameter":
                self._declared(name, ca.MX(ca.DM(self._fixed(name))))

    def _initial(self) -> None:
        """Turn initial equations into start values."""
        for symbol, expression in zip(self.dae.init_lhs(), self.dae.init_rhs(), strict=True):
            name = symbol.name()
            if self._category(name) not in _STATES:
                raise self._refuse(
                    name, "has an initial equation (set_init) but is no state; remove it"
                )
            value = self._of(expression)
            free = ca.symvar(value)
            if free:
                raise self._refuse(
                    name,
                    f"starts at {expression}, which depends on '{free[0].name()}'; a plant's "
                    "start values are numbers: remove set_init, give a start, and set "
                    f"'{name}' in the FMU",
                )
            numbers = ca.evalf(ca.densify(value)).nonzeros()
            self.started[name] = numbers * (self.dae.numel(name) // len(numbers))

    def _input(self, name: str) -> None:
        self._real(name, "inputs")
        start, size = self._start(name), self._size(name)
        symbol = self.plant.input(name, start=start, size=size, **self._attributes(name))
        self._declared(name, symbol)

    def _parameter(self, name: str) -> None:
        if self.dae.causality(name) != "parameter":
            return  # a constant
        self._real(name, "parameters")
        start = self._fixed(name) if self._category(name) == "c" else self._start(name)
        tunable = self.dae.variability(name) == "tunable"
        options = {"tunable": tunable, "size": self._size(name), **self._attributes(name)}
        self._declared(name, self.plant.parameter(name, start, **options))

    def _state(self, name: str) -> None:
        output = name in self.outputs or not self.outputs
        options = {
            "start": self._start(name), "size": self._size(name), "output": output,
            **self._attributes(name),
        }  # fmt: skip
        if self.dae.variability(name) != "discrete":
            self._real(name, "states with a derivative")
            symbol = self.plant.state(name, **options)
        elif self.dae.type(name) in _REAL:
            symbol = self.plant.memory(name, **options)
        else:
            symbol = self.plant.mode(name, **self._whole(name, options))
        self._declared(name, symbol)

    def _whole(self, name: str, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options of an integer or Boolean, which has no unit and no nominal value."""
        kind = self.dae.type(name)
        if kind not in _WHOLE:
            raise self._refuse(
                name, f"is of type {kind}; a plant's discrete variables are Float64, Int32, Boolean"
            )
        unit = options.pop("unit")
        if unit != "1":
            raise self._refuse(
                name, f"is of type {kind} with unit '{unit}'; leave the unit out or use Float64"
            )
        options.pop("nominal")
        if kind == "Boolean":
            return {**options, "minimum": 0, "maximum": 1}
        if kind.startswith("U") and options["minimum"] is None:
            options["minimum"] = 0
        return options

    def _definition(self, name: str, expression: ca.MX) -> None:
        """Declare a dependent parameter; anything else is substituted out."""
        value = self._of(expression)
        if self._category(name) == "d" and name not in self.outputs:
            self._real(name, "dependent parameters")
            attributes = self._attributes(name)
            value = self.plant.dependent(
                name, value, unit=attributes["unit"], description=attributes["description"]
            )
        self._declared(name, value)

    def _rates(self) -> dict[str, ca.MX]:
        """Return the right-hand side of every state with a derivative."""
        rates = [*zip(self.dae.x(), self.dae.outputs("ode"), strict=True)]
        rates += zip(self.dae.q(), self.dae.outputs("quad"), strict=True)
        return {name: r for name, r in rates if self.dae.variability(name) != "discrete"}

    def _output(self, name: str, expression: ca.MX) -> None:
        if self._category(name) in _STATES:
            return  # declared as a port already
        if not self._category(name):
            raise self._refuse(
                name, f"is an output without a category; use dae.set_category('{name}', 'q')"
            )
        self._real(name, "computed outputs")
        self.plant.output(name, self._of(expression), **self._attributes(name))

    def _event(self, when: When) -> None:
        """Declare an event; a when-equation that changes nothing is none."""
        for name in when.changes:
            if self._category(name) not in _STATES:
                raise self._refuse(
                    name,
                    f"is assigned by when-equation {when.number} but is neither a state nor "
                    "discrete; assign a discrete variable and compute with that",
                )
        if when.changes:
            new = {n: self._of(expression) for n, expression in when.changes.items()}
            changes = {self.known[self.dae.var(n).__hash__()]: value for n, value in new.items()}
            ours = replace(when, crossing=self._of(when.crossing), changes=new)
            declare_event(self.dae, self.plant, ours, changes)
