"""Calls of FMI functions with everything prepared: per step only numbers change.

A call is (function, arguments, name). Arguments are ctypes objects made once, and functions have
no argument types: so ctypes converts nothing (measured: 1.0 µs for the three calls of a step,
where FMPy's own function objects take 2.3).
"""

from collections.abc import Sequence
from ctypes import (
    CFUNCTYPE,
    PYFUNCTYPE,
    byref,
    c_double,
    c_int,
    c_size_t,
    c_uint,
    c_void_p,
    cast,
    sizeof,
)
from typing import Any

# FMI type -> (FMI function suffix, ctypes type); an enumeration travels as an integer.
TYPES = {
    "Real": ("Real", c_double),
    "Integer": ("Integer", c_int),
    "Enumeration": ("Integer", c_int),
    "Boolean": ("Boolean", c_int),
}
CONVERSIONS = {"Real": None, "Integer": round, "Boolean": bool}

Call = tuple[Any, tuple[Any, ...], str]


class Functions:
    """An FMU library's functions, to be called for one instance.

    With `holds_gil` the interpreter's lock is kept during a call, which saves a little. That is
    for FMUs known to call back only from the calling thread: another one would wait for ever.
    """

    def __init__(self, library: Any, component: int, *, holds_gil: bool) -> None:
        self._library = library
        self._type = (PYFUNCTYPE if holds_gil else CFUNCTYPE)(c_int)
        self._component = c_void_p(component)

    def call(self, name: str, *arguments: Any) -> Call:
        """Return the prepared call of a function with the instance as its first argument."""
        address = cast(getattr(self._library, name), c_void_p).value
        assert address is not None
        return self._type(address), (self._component, *arguments), name


class Group:
    """Variables of one FMI type, read or written in one call."""

    def __init__(self, kind: str, variables: Sequence[Any]) -> None:
        self.suffix, c_type = TYPES[kind]
        self.names = [v.name for v in variables]
        self.size = len(variables)
        self.references = (c_uint * self.size)(*(v.valueReference for v in variables))
        self.values = (c_type * self.size)()

    @classmethod
    def of(cls, variables: Sequence[Any]) -> "list[Group]":
        """Return the variables in groups of one type each."""
        kinds = dict.fromkeys(v.type for v in variables)
        return [cls(kind, [v for v in variables if v.type == kind]) for kind in kinds]

    def call(self, functions: Functions, verb: str) -> Call:
        """Return the call that sets ("Set") or gets ("Get") the values."""
        return self._call(functions, verb, self.references, self.values)

    def call_between(self, functions: Functions, verb: str, first: int, end: int) -> Call:
        """Return the call for a part of the variables, from place `first` up to before `end`."""
        parts = (
            (array._type_ * (end - first)).from_buffer(array, first * sizeof(array._type_))
            for array in (self.references, self.values)
        )
        return self._call(functions, verb, *parts)

    def _call(self, functions: Functions, verb: str, references: Any, values: Any) -> Call:
        arguments = (byref(references), c_size_t(len(references)), byref(values))
        return functions.call(f"fmi2{verb}{self.suffix}", *arguments)


def slots(names: Sequence[str], groups: Sequence[Group]) -> list[tuple[Any, int, Any]]:
    """Return (array, index, conversion) of each name; reals need no conversion."""
    found = {
        name: (group.values, i, CONVERSIONS[group.suffix])
        for group in groups
        for i, name in enumerate(group.names)
    }
    return [found[name] for name in names]


class PortArrays:
    """An instance's ports as slots of arrays, (array, index, conversion) each in the ports' order.

    `slope_slots` are the places of the inputs' first derivatives in `slope_values`, None for an
    input that is no real.
    """

    input_slots: list[tuple[Any, int, Any]]
    output_slots: list[tuple[Any, int, Any]]
    slope_slots: list[int | None]
    slope_values: Any

    def inputs(self, values: Sequence[float]) -> None:
        """Write input values, in the ports' order, where put() and advance() take them."""
        for (array, i, convert), value in zip(self.input_slots, values, strict=True):
            array[i] = convert(value) if convert else value

    def slopes(self, values: Sequence[float]) -> None:
        """Write the inputs' first derivatives, in the ports' order, for advance_sloped()."""
        for i, value in zip(self.slope_slots, values, strict=True):
            if i is not None:
                self.slope_values[i] = value

    def outputs(self) -> tuple[float, ...]:
        """Return the outputs last fetched, in the ports' order."""
        return tuple(float(array[i]) for array, i, _ in self.output_slots)
