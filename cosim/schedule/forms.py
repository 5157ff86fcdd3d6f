"""What of a schedule is form, and what are values: the form alone decides an engine's program.

So diagrams that differ in their blocks' parameters share one program, with other values in it.
"""

from collections.abc import Callable, Hashable, Iterable, Iterator
from typing import Any

from .operations import (
    Advance,
    Announce,
    Branch,
    Call,
    Divide,
    Edge,
    Keep,
    Operation,
    Past,
    Read,
    Stop,
    Within,
)

Values = tuple[Any, ...]


def pieces(operations: Iterable[Operation]) -> Iterator[Any]:
    """Yield the operations with those inside them, and the tests, in an order that is the form's.

    What comes out has a form and values of its own; see `apart`.
    """
    for operation in operations:
        yield operation
        if isinstance(operation, Branch):
            yield from operation.tests
            yield from pieces((operation.call, *operation.otherwise))
        elif isinstance(operation, Divide):
            yield from operation.steps
            for stop in operation.stops:
                yield stop
                yield from stop.tests
                yield from pieces((*stop.signals, *stop.steps))
            yield from pieces(operation.otherwise)


def apart(piece: Any) -> tuple[Hashable, Values]:
    """Return the form of a piece and the values in it."""
    take = _TAKE.get(type(piece))
    return (piece, ()) if take is None else take(piece)


def _call(o: Call) -> tuple[Hashable, Values]:
    return (Call, o.arguments, o.results, o.node, o.every), (o.function,)


def _read(o: Read) -> tuple[Hashable, Values]:
    slots = tuple((register, id(array), slot) for register, array, slot in o.values)
    return (Read, slots, o.node, o.every), ()


def _advance(o: Advance) -> tuple[Hashable, Values]:
    form = (Advance, id(o.instance), o.inputs, o.span, o.node, o.every, o.divided, o.outputs)
    return form, ()


def _past(o: Past) -> tuple[Hashable, Values]:
    takes_newest = o.whole == 0 and not o.ahead
    form = (
        Past, o.result, o.ring, o.newest, o.node, o.ahead,
        takes_newest, o.part != 0.0, o.first > o.ahead, callable(o.initial),
    )  # fmt: skip
    back = o.whole - o.ahead
    return form, (o.length, back, back + 1, o.part, o.first - o.ahead, o.initial, o.time)


def _keep(o: Keep) -> tuple[Hashable, Values]:
    return (Keep, o.ring, o.source, o.node), (o.length,)


def _announce(o: Announce) -> tuple[Hashable, Values]:
    return (Announce, o.event, o.state, o.node), (o.function,)


def _branch(o: Branch) -> tuple[Hashable, Values]:
    return (Branch, len(o.tests), len(o.otherwise)), ()


def _edge(o: Edge) -> tuple[Hashable, Values]:
    return (Edge, o.ring, o.always), (o.first, o.whole, o.whole - 1, o.length)


def _within(o: Within) -> tuple[Hashable, Values]:
    has_part = o.part != 0.0 and o.shift < 0
    form = (Within, o.result, o.ring, o.node, has_part, callable(o.initial))
    return form, (o.length, o.shift, o.shift + 1, o.part, o.initial)


def _stop(o: Stop) -> tuple[Hashable, Values]:
    return (Stop, len(o.tests), len(o.signals), len(o.steps)), (*o.time, *o.spans)


def _divide(o: Divide) -> tuple[Hashable, Values]:
    return (Divide, len(o.steps), len(o.stops), len(o.otherwise)), o.spans


_TAKE: dict[type, Callable[[Any], tuple[Hashable, Values]]] = {
    Call: _call,
    Read: _read,
    Advance: _advance,
    Past: _past,
    Keep: _keep,
    Announce: _announce,
    Branch: _branch,
    Edge: _edge,
    Within: _within,
    Stop: _stop,
    Divide: _divide,
}
