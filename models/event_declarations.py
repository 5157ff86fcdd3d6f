"""Declaring what changes at instants: events, and memories that are updated after steps."""

from collections.abc import Mapping
from typing import Any

from ..base.errors import DeclarationError, listing
from ..base.ops import finite
from .declarations import Declarations
from .event import CONDITIONS, DIRECTIONS, Direction, Event, check_changes, sized
from .variable import check_name


class EventDeclarations(Declarations):
    """The part of a plant's declaration that is about instants."""

    def update(self, memory: Any, expression: Any) -> None:
        """Give a memory's value after each inner step, from all values at the step's end.

        For what is path-dependent, such as hysteresis: the step is the solver's, so the result
        must converge with it.
        """
        self._open("update")
        variable = self._required(memory, "memory", "update()")
        if variable.name in self._updates:
            raise DeclarationError(f"plant '{self.name}': update({variable.name}) is given twice")
        what = f"update({variable.name})"
        value = self._expression(expression, what)
        self._updates[variable.name] = sized(value, variable.length, f"plant '{self.name}', {what}")

    def event(
        self,
        name: str,
        crossing: Any,
        *,
        direction: Direction,
        changes: Mapping[Any, Any],
        when: Any = 1.0,
        nominal: float = 1.0,
        description: str = "",
    ) -> None:
        """Declare a state event: it fires when `crossing` passes zero while `when` holds.

        "rising" fires when crossing > 0 becomes true, "falling" when crossing < 0 does, "both"
        when its sign changes. What holds already at the start, or comes true through another
        event, an input or a parameter, fires too ("both" not at the start). `when` may use modes,
        memories and parameters. `changes` maps states, modes and memories to their new values,
        all computed from the values before the event. A vector `crossing` makes one event for
        each element, which changes its own elements of vectors. Where several fire at once, the
        one declared first goes first, and the others follow if they still hold. `nominal` is the
        crossing's usual size, which Model Exchange shows it in.
        """
        if direction not in DIRECTIONS:
            raise DeclarationError(
                f"plant '{self.name}', event '{name}': direction must be one of "
                f"{listing(DIRECTIONS)}, not {direction!r}"
            )
        if not (finite(nominal) and nominal > 0.0):
            raise DeclarationError(
                f"plant '{self.name}', event '{name}': nominal must be a positive number"
            )
        self._event(name, "state", crossing, direction, when, changes, nominal, description)

    def time_event(
        self,
        name: str,
        at: Any,
        *,
        changes: Mapping[Any, Any],
        when: Any = 1.0,
        description: str = "",
    ) -> None:
        """Declare a time event: it fires when the time reaches `at` (s) while `when` holds.

        `at` and `when` may use modes, memories and parameters: an event that moves a memory in
        `at` onwards repeats. The solver steps exactly onto that time.
        """
        self._event(name, "time", at, "rising", when, changes, 1.0, description)

    def _event(
        self,
        name: str,
        kind: Any,
        expression: Any,
        direction: Direction,
        when: Any,
        changes: Mapping[Any, Any],
        nominal: float,
        description: str,
    ) -> None:
        self._open(name)
        what = f"event '{name}'"
        where = f"plant '{self.name}', {what}"
        check_name(name, where)
        if name in self._events:
            raise DeclarationError(f"{where}: the name is taken by another event")
        of = self._settled if kind == "time" else self._expression
        value = of(expression, f"{what}: its {'time' if kind == 'time' else 'crossing'}")
        if kind == "state" and any(value.is_op(op) for op in CONDITIONS):
            raise DeclarationError(
                f"{where}: the crossing is a condition; write what passes zero, such as x - 0.5 "
                "for x > 0.5"
            )
        guard = sized(self._settled(when, f"{what}: when"), value.shape[0], f"{where}: when")
        targets = {}
        for symbol, change in changes.items():
            variable = self._of_symbol(symbol)
            if variable is None:
                raise DeclarationError(f"{where} {_not_a_symbol(symbol, self._variables)}")
            targets[variable] = self._expression(change, f"{what}: change of '{variable.name}'")
        size = value.shape[0]
        found = check_changes(where, size, targets)
        self._events[name] = Event(
            name, kind, size, value, direction, guard, found, float(nominal), description
        )


def _not_a_symbol(given: Any, variables: Mapping[str, Any]) -> str:
    """Return why what is to be changed is no declared symbol."""
    if isinstance(given, str) and given in variables:
        return f"changes '{given}': write the symbol that declared it, not its name"
    if given is None:
        return "changes None: output() returns no symbol; events change states, modes and memories"
    return f"changes '{given}', which is not declared here"
