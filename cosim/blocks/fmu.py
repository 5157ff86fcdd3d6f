"""An FMI 2.0 co-simulation FMU as a block."""

import math
from collections.abc import Mapping
from itertools import count, takewhile
from pathlib import Path
from typing import Any, Self

from ...base.errors import FmuError, ParameterError, UnitError, listing, suggest
from ...base.units import parse
from ..block import Block, Ports, require, require_positive
from ..fmu.calls import TYPES
from ..fmu.file import (
    binary_of,
    direct_inputs,
    number_of,
    read_description,
    start_of,
    unit_of,
)
from ..fmu.instance import FmuInstance


class Fmu(Block):
    """An FMU: its inputs and outputs are ports, its parameters and start values are keywords.

    `path` is a path to any FMI 2.0 co-simulation FMU; `period` (s) the communication step if it
    is not the diagram's. An input given as a keyword is held at that value and is no port. A
    vector may be given whole: mass=[1, 2] for mass[1] and mass[2]. With `isolated` the FMU runs in
    a process of its own: what crashes, exits or takes longer for a call than `timeout` (s; None:
    for ever) ends that process, and is an error of the block here. Raise FmuError for a file that
    is no such FMU or has no binary for this machine, ParameterError for a wrong keyword.

    An FMU's outputs never feed through within a step: FMI 2.0 forbids reading them after setting
    inputs without a step between, but for initialization, where the run settles them.
    """

    __slots__ = (
        "_computed",
        "_description",
        "_settable",
        "direct_inputs",
        "guid",
        "inputs",
        "isolated",
        "outputs",
        "path",
        "period",
        "timeout",
        "types",
        "values",
    )

    run_by_engine = True
    continuous = True
    feedthrough = False
    shares_unit = False  # a variable without a unit connects to any

    def __init__(
        self,
        path: str | Path,
        *,
        period: float | None = None,
        isolated: bool = False,
        timeout: float | None = 60.0,
        **values: Any,
    ) -> None:
        self._read(path, values, period, isolated, timeout)

    @classmethod
    def with_values(
        cls,
        path: str | Path,
        values: Mapping[str, Any],
        *,
        period: float | None = None,
        isolated: bool = False,
        timeout: float | None = 60.0,
    ) -> Self:
        """Return the block with values by name: for names that are no keywords, or taken."""
        made = cls.__new__(cls)
        made._read(path, values, period, isolated, timeout)
        return made

    def _read(
        self,
        path: str | Path,
        values: Mapping[str, Any],
        period: float | None,
        isolated: bool,
        timeout: float | None,
    ) -> None:
        if not isinstance(path, str | Path):
            raise FmuError(f"Fmu() needs an FMU's path, not {path!r}; build(plant) returns one")
        self.path = Path(path).absolute()
        self.period, self.isolated, self.timeout = period, isolated, timeout
        good = isinstance(isolated, bool)
        require(self, good, f"isolated is True or False, not {isolated!r}")
        for name in ("period", "timeout"):
            if getattr(self, name) is not None:
                require_positive(self, name)
        description = read_description(self.path)
        binary_of(self.path, description)
        variables = description.modelVariables
        self._description = description
        self.guid = description.guid
        self._settable = {v.name: v for v in variables if _settable(v)}
        self._computed = {v.name for v in variables} - self._settable.keys()
        self.values = self._checked(values)
        ports = [v for v in variables if v.type in TYPES]
        self.inputs: Ports = {
            v.name: _unit(v) for v in ports if v.causality == "input" and v.name not in self.values
        }
        self.outputs: Ports = {v.name: _unit(v) for v in ports if v.causality == "output"}
        self.types = {
            v.name: _COLUMNS[v.type]
            for v in ports
            if v.causality == "output" and v.type in _COLUMNS
        }
        self.direct_inputs = direct_inputs(description) & self.inputs.keys()

    def __repr__(self) -> str:
        given = "".join(f", {name}={value!r}" for name, value in self.values.items())
        return f"Fmu({self.path.name!r}{given})"

    def __reduce__(self) -> Any:
        return _remake, (self.path, self.values, self._options())

    def _options(self) -> dict[str, Any]:
        return {"period": self.period, "isolated": self.isolated, "timeout": self.timeout}

    def parameters(self) -> dict[str, Any]:
        """Return parameters (and start values that were given), each with its value."""
        declared = {
            name: start_of(v) for name, v in self._settable.items() if v.causality == "parameter"
        }
        return declared | self.values

    def with_parameter(self, name: str, value: Any) -> Self:
        """Return a copy with one parameter or start value changed."""
        return self.with_parameters({name: value})

    def with_parameters(self, values: Mapping[str, Any]) -> Self:
        """Return a copy with some parameters and start values changed."""
        for name in values:
            variable = self._settable.get(name)
            if variable is not None and variable.causality == "input" and name in self.inputs:
                where = self.path.name
                raise ParameterError(f"{where}: '{name}' is an input port, not a parameter")
        values = {**self.values, **self._checked(values)}
        if read_description(self.path) is not self._description:  # the file is another one by now
            return self.with_values(self.path, values, **self._options())
        made = type(self).__new__(type(self))
        for slot in Fmu.__slots__:
            setattr(made, slot, getattr(self, slot))
        made.values = values
        return made

    def form(self) -> tuple[Any, ...]:
        """Return what an instance is made by, beside the values."""
        return self.path, self.isolated, self.timeout, tuple(self.inputs), tuple(self.outputs)

    def instance(self, name: str) -> FmuInstance:
        """Return a fresh instance under a block's name, with its values set."""
        made = self._instantiated(name, list(self.inputs), list(self.outputs))
        try:
            for variable, value in self.values.items():
                made.set(variable, value)
        except BaseException:
            made.close()
            raise
        return made

    def _instantiated(self, name: str, inputs: list[str], outputs: list[str]) -> Any:
        if not self.isolated:
            return FmuInstance(name, self.path, inputs, outputs)
        from ..isolated import IsolatedInstance

        return IsolatedInstance(name, self.path, inputs, outputs, timeout=self.timeout)

    def tunable(self, name: str) -> bool:
        """Return whether a parameter may be changed during a run; raise ParameterError for none."""
        self.with_parameter(name, self.parameters().get(name))
        return self._settable[name].variability == "tunable"

    def _checked(self, given: Mapping[str, Any]) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for name, value in given.items():
            elements = value.tolist() if hasattr(value, "tolist") else value
            if isinstance(elements, list | tuple):
                names = self._element_names(name)
                if len(names) != len(elements):
                    raise ParameterError(
                        f"{self.path.name}: {len(elements)} values given for '{name}', "
                        f"which has {len(names) or 'no elements'}"
                    )
                for element_name, element in zip(names, elements, strict=True):
                    values[element_name] = self._value(element_name, element)
            elif f"{name}[1]" in self._settable:
                raise ParameterError(
                    f"{self.path.name}: '{name}' is a vector; give a list, or set {name}[1], …"
                )
            else:
                values[name] = self._value(name, elements)
        return values

    def _element_names(self, name: str) -> list[str]:
        """Return a vector's elements: mass[1], … for "mass", car[1].v, … for "car[].v"."""
        pattern = name if "[]" in name else f"{name}[]"
        numbered = (pattern.replace("[]", f"[{i}]") for i in count(1))
        return list(takewhile(self._settable.__contains__, numbered))

    def _value(self, name: str, value: Any) -> Any:
        where = self.path.name
        variable = self._settable.get(name)
        if name in self._computed:
            raise ParameterError(f"{where}: {name} is computed by the FMU and cannot be set")
        if variable is None:
            known = sorted(self._settable, key=lambda n: _RANK[self._settable[n].causality])
            raise ParameterError(
                f"{where} has nothing to set named '{name}'; there are: {listing(known)}"
                f"{suggest(name, self._settable)}"
            )
        if variable.type == "String":
            return str(value)
        if isinstance(value, bool) != (variable.type == "Boolean") or not isinstance(
            value, int | float
        ):
            raise ParameterError(f"{where}: {name} is a {variable.type}, {value!r} is not")
        if variable.type in ("Integer", "Enumeration") and value != int(value):
            raise ParameterError(f"{where}: {name} is a whole number, {value!r} is not")
        _check_range(where, variable, value)
        return value


_COLUMNS = {"Integer": "int64", "Enumeration": "int64", "Boolean": "bool"}

# Parameters first in a list of what can be set, then inputs, then start values.
_RANK = {"parameter": 0, "input": 1, "output": 2, "local": 2}


def _check_range(where: str, variable: Any, value: float) -> None:
    low = number_of(variable, "min", -math.inf)
    high = number_of(variable, "max", math.inf)
    assert low is not None and high is not None
    if not math.isfinite(value):
        raise ParameterError(f"{where}: {variable.name} = {value:g} is not finite")
    if not low <= value <= high:
        unit = f" {variable.unit}" if variable.unit not in (None, "1") else ""
        raise ParameterError(
            f"{where}: {variable.name} = {value:g}{unit} lies outside [{low:g}, {high:g}]"
        )


def _settable(v: Any) -> bool:
    return v.causality in ("parameter", "input") or (
        v.initial in ("exact", "approx") and v.variability != "constant"
    )


def _unit(v: Any) -> str | None:
    """Return the port's unit; None where the FMU gives none, or one that we cannot read."""
    unit = unit_of(v)
    try:
        parse(unit or "")
    except UnitError:
        return None
    return unit


def _remake(path: Path, values: dict[str, Any], options: dict[str, Any]) -> Fmu:
    return Fmu.with_values(path, values, **options)
