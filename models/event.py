"""Events of a plant: what may change when a crossing is found or a time has come."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import casadi as ca

from ..base.errors import DeclarationError
from .variable import Variable

Direction = Literal["rising", "falling", "both"]
DIRECTIONS: tuple[Direction, ...] = ("rising", "falling", "both")
CHANGED = ("state", "mode", "memory")  # what events may change
CONDITIONS = (ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR)
DISCRETE = ("mode", "memory", "parameter", "dependent")  # what guards and times may depend on


@dataclass(frozen=True)
class Event:
    """A declared event of `size` elements.

    `kind` "state": it fires where `expression` crosses zero in its direction while `guard` is
    true. `kind` "time": it fires when the time reaches `expression`. `changes` gives, by name,
    the new value of each variable that it changes, whole vectors; a vector event changes only
    the elements that fired. `nominal` is the crossing's usual size, in its own unit.
    """

    name: str
    kind: Literal["state", "time"]
    size: int
    expression: ca.MX
    direction: Direction
    guard: ca.MX
    changes: Mapping[str, ca.MX]
    nominal: float
    description: str

    @property
    def element_names(self) -> tuple[str, ...]:
        """Names for messages: "stop", or "stop[1]", "stop[2]", …"""
        if self.size == 1:
            return (self.name,)
        return tuple(f"{self.name}[{i + 1}]" for i in range(self.size))


def sized(value: ca.MX, size: int, where: str) -> ca.MX:
    """Return a column of `size` elements; a scalar is repeated."""
    if value.shape == (size, 1):
        return value
    if value.is_scalar():
        return ca.repmat(value, size, 1)
    raise DeclarationError(f"{where} has {value.shape[0]} elements, {size} are needed")


def check_changes(where: str, size: int, changes: Mapping[Variable, ca.MX]) -> dict[str, ca.MX]:
    """Return the changes by name; a vector event changes vectors of its own size, by element."""
    if not changes:
        raise DeclarationError(f"{where}: an event must change something")
    found = {}
    for variable, value in changes.items():
        what = f"{where}: the change of '{variable.name}'"
        if variable.kind not in CHANGED:
            raise DeclarationError(
                f"{what}: events change states, modes and memories, not {variable.kind}s; declare "
                "what an event must change as a memory"
            )
        if size > 1 and variable.length != size:
            raise DeclarationError(
                f"{what}: a vector event changes vectors of its own {size} elements, "
                f"not of {variable.length}"
            )
        found[variable.name] = sized(value, variable.length, what)
    return found
