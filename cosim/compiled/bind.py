"""The values of a schedule's pieces into the table's structures.

Each function takes a structure and the values in the order in which `forms.apart` gives them. The
structures point to objects that the table keeps.
"""

from types import MethodType
from typing import Any

from ..schedule.forms import Values

EXACT = 2**53  # whole numbers up to here are doubles


def function(what: Any, values: Values) -> None:
    """A function, as what it is bound to and the rest: calling that is faster than a method."""
    (function,) = values
    if type(function) is MethodType:
        what.function, what.self = id(function.__func__), id(function.__self__)
    else:
        what.function, what.self = id(function), None


def past(what: Any, has_part: bool, values: Values) -> None:
    """A delay's output; without a `part` that is exactly 0."""
    what.length, back, _, part, what.first, initial, what.time = values
    what.whole, what.part = back + what.ahead, part if has_part else 0.0
    what.part_object, what.initial = id(part), id(initial)
    what.history = id(initial) if callable(initial) else None


def within(what: Any, values: Values) -> None:
    """A delay's output inside a tick."""
    what.length, what.shift, _, what.part, initial = values
    what.part_object, what.initial = id(values[3]), id(initial)
    what.history = id(initial) if callable(initial) else None


def keep(what: Any, values: Values) -> None:
    """A delay's ring."""
    (what.length,) = values


def edge(what: Any, values: Values) -> None:
    """The test for a jump."""
    what.first, what.whole, _, what.length = values


def stop(what: Any, spans: Any, values: Values) -> None:
    """A place inside a tick: its time, and the spans that begin there."""
    a, b, q, *spans[:] = values
    what.a_object, what.b_object, what.q_object = map(id, values[:3])
    exact = max(abs(a), b, q) <= EXACT
    what.last = (EXACT - abs(a)) // b if exact else -1
    if exact:
        what.a, what.b, what.q = a, b, q


def divide(spans: Any, values: Values) -> None:
    """The spans that begin with the tick."""
    spans[:] = values
