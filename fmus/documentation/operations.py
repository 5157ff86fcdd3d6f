"""A scalar CasADi SX expression as a list of operations, arguments before what uses them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import casadi as ca

from .elements import Row, rows
from .nodes import UnprintableError

Family = Literal["sum", "product", "min", "max", "and", "or"]
FAMILIES: dict[int, Family] = {  # operations that chain
    ca.OP_ADD: "sum", ca.OP_SUB: "sum", ca.OP_NEG: "sum", ca.OP_MUL: "product",
    ca.OP_FMIN: "min", ca.OP_FMAX: "max", ca.OP_AND: "and", ca.OP_OR: "or",
}  # fmt: skip
_LARGEST = 10_000  # operations; more would take long, and nobody reads them
_LONG = 30  # links from which on a chain's links are compared before they are followed
_IDENTITIES = {"sum": 0.0, "min": float("inf"), "max": -float("inf")}


@dataclass
class Folded:
    """A long chain of which few rows say what its links are; `element` gives one of them."""

    element: Callable[[int], ca.SX]
    rows: list[Row]


@dataclass
class Operation:
    """One operation; its arguments are places in the list, `uses` counts where it is one."""

    expression: ca.SX
    code: int
    args: list[int] = field(default_factory=list)
    folded: Folded | None = None
    uses: int = 0
    user: int = -1

    @property
    def family(self) -> Family | None:
        """What it is a link of, if it chains."""
        return FAMILIES.get(self.code)


def operations(root: ca.SX, fold: Callable[[Family, ca.SX], Folded | None]) -> list[Operation]:
    """Return the operations of an expression, the last one its result.

    `fold` may shorten a long chain. Raise UnprintableError for too many operations.
    """
    found: list[Operation] = []
    places: dict[int, int] = {}  # by the expression's identity
    stack: list[tuple[ca.SX, Family | None, list[ca.SX] | None]] = [(root, None, None)]
    while stack:
        expression, above, args = stack.pop()
        identity = expression.element_hash()
        if identity in places:
            continue
        code = ca.OP_CONST if expression.is_constant() else expression.op()
        if args is None:
            family = FAMILIES.get(code)
            starts = family in _IDENTITIES and family != above
            folded = fold(family, expression) if family and starts else None
            args = [] if folded else [expression.dep(i) for i in range(expression.n_dep())]
            if args:
                stack.append((expression, above, args))
                stack.extend((a, family, None) for a in reversed(args))
                continue
            found.append(Operation(expression, code, folded=folded))
        else:
            found.append(Operation(expression, code, [places[a.element_hash()] for a in args]))
        places[identity] = len(found) - 1
        if len(found) > _LARGEST:
            raise UnprintableError
    for place, operation in enumerate(found):
        for used in operation.args:
            found[used].uses += 1
            found[used].user = place
    return found


def folded_chain(family: Family, end: ca.SX, symbols: Sequence[ca.SX]) -> Folded | None:
    """Return a long chain folded, None if it is short or irregular."""
    links: list[ca.SX] = []
    while FAMILIES.get(end.op()) == family and end.n_dep() == 2:
        link = end.dep(1)
        links.append(-link if end.op() == ca.OP_SUB else link)
        end = end.dep(0)
        if end.is_constant():
            break
    if not (end.is_constant() and float(end) == _IDENTITIES[family]):
        links.append(end)
    if len(links) < _LONG:
        return None
    column = ca.vertcat(*reversed(links))
    found, omitted = rows(column, symbols)
    return Folded(lambda i: column[i], found) if is_regular(found, omitted) else None


def is_regular(found: Sequence[Row], omitted: int) -> bool:
    """Return whether rows are all of a chain, each without gaps."""
    return not omitted and all(r.indices[-1] - r.indices[0] + 1 == len(r.indices) for r in found)
