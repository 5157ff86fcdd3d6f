"""Expressions as small trees: what is shown, before it is typeset."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

Kind = Literal[
    "number", "symbol", "sum", "negative", "product", "quotient", "power", "call", "cases",
    "compare", "and", "or", "not", "min", "max", "series",
]  # fmt: skip
CONDITIONS = ("compare", "and", "or", "not")
LARGEST_DEPTH = 200  # nested deeper than this, nobody reads it


class UnprintableError(Exception):
    """An expression that has no tree; it is shown in other words."""


@dataclass(frozen=True)
class Symbol:
    """A variable or one element of it: `number` counts from 1, or from the running `letter`.

    An auxiliary symbol is none of the plant's variables: it abbreviates a subexpression, which
    may depend on the letters of the series around it; `letter` then holds those. A symbol without
    a name is the number itself.
    """

    name: str
    number: int | None = None
    letter: str = ""
    auxiliary: bool = False


@dataclass(frozen=True)
class Running:
    """What a series runs over: `operator` is sum, min, max, and, or; bounds are included."""

    operator: Kind
    letter: str
    first: int
    last: int


Value = float | str | Symbol | Running | None


@dataclass(frozen=True, eq=False)
class Node:
    """`value` is a number's value, a symbol, a called function's name, a comparison's sign.

    The arguments of "cases" are value, condition, value, condition, …, value otherwise. `depth`
    and `weight` are those of the tree, in which what is shared stands repeatedly.
    """

    kind: Kind
    args: tuple["Node", ...] = ()
    value: Value = None
    depth: int = 1
    weight: int = 1


class Nodes:
    """Makes nodes; equal ones are one object, so that a tree knows what it repeats."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[Kind, tuple[int, ...], Value], Node] = {}

    def node(self, kind: Kind, args: Sequence[Node] = (), value: Value = None) -> Node:
        """Return the node as it is given; raise UnprintableError if it is nested too deeply."""
        key = (kind, tuple(map(id, args)), value)
        found = self._nodes.get(key)
        if found is None:
            depth = 1 + max((a.depth for a in args), default=0)
            if depth > LARGEST_DEPTH:
                raise UnprintableError
            weight = 1 + sum(a.weight for a in args)
            found = self._nodes[key] = Node(kind, tuple(args), value, depth, weight)
        return found

    def again(self, node: Node, args: Sequence[Node]) -> Node:
        """Return a node like another with other arguments."""
        return self.node(node.kind, args, node.value)


def reachable(roots: Iterable[Node]) -> Iterator[Node]:
    """Yield every node under the roots once, arguments before what uses them."""
    seen: set[Node] = set()
    stack = [(root, False) for root in reversed(list(roots))]
    while stack:
        node, finished = stack.pop()
        if finished:
            yield node
        elif node not in seen:
            seen.add(node)
            stack.append((node, True))
            stack.extend((a, False) for a in reversed(node.args))
