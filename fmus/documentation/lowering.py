"""One scalar CasADi SX expression -> a tree of nodes."""

from collections.abc import Callable, Sequence

import casadi as ca

from .algebra import Algebra
from .columns import Columns, Total, total_place
from .elements import Progression, Row
from .nodes import Node, Running, Symbol, UnprintableError
from .operations import (
    FAMILIES,
    Family,
    Folded,
    Operation,
    folded_chain,
    is_regular,
    operations,
)
from .patterns import rows_of
from .series import SHORTEST, series

Leaves = Callable[[str], Node]  # what is shown for a symbol, by its name
_LONG_TOTAL = 8  # terms from which on a total's are compared before they are followed
_NAMES = {
    ca.OP_SQRT: "sqrt", ca.OP_FABS: "abs", ca.OP_FLOOR: "floor", ca.OP_CEIL: "ceil",
    ca.OP_SIN: "sin", ca.OP_COS: "cos", ca.OP_TAN: "tan",
    ca.OP_ASIN: "arcsin", ca.OP_ACOS: "arccos", ca.OP_ATAN: "arctan", ca.OP_ATAN2: "arctan2",
    ca.OP_SINH: "sinh", ca.OP_COSH: "cosh", ca.OP_TANH: "tanh",
    ca.OP_ASINH: "arsinh", ca.OP_ACOSH: "arcosh", ca.OP_ATANH: "artanh",
    ca.OP_EXP: "exp", ca.OP_LOG: "ln", ca.OP_SIGN: "sgn", ca.OP_ERF: "erf",
    ca.OP_ERFINV: "erfinv", ca.OP_FMOD: "fmod", ca.OP_REMAINDER: "remainder",
    ca.OP_COPYSIGN: "copysign",
}  # fmt: skip


class Lowering:
    """Makes trees of expressions in `arguments` (see `elements`); letters are for series."""

    def __init__(
        self,
        algebra: Algebra,
        arguments: Sequence[ca.SX],
        letters: Sequence[str],
        *,
        columns: Columns,
        fixed: Leaves,
    ) -> None:
        self._algebra = algebra
        self._arguments = arguments
        self._letters = letters
        self._columns = columns
        self._fixed = fixed  # what is shown for an argument's element
        self._totals: dict[tuple[int, int], Node] = {}  # by place and depth

    def lower(self, expression: ca.SX, leaves: Leaves, depth: int = 0) -> Node:
        """Return an expression as a tree; `depth` counts the series around it.

        Raise UnprintableError for what has no tree: too large, nested too deeply, a NaN.
        """

        def fold(family: Family, end: ca.SX) -> Folded | None:
            nested = depth < len(self._letters)
            return folded_chain(family, end, self._arguments) if nested else None

        found = operations(expression, fold)
        nodes: list[Node | None] = []
        for place, operation in enumerate(found):
            self._algebra.letter = self._letters[depth] if depth < len(self._letters) else ""
            if operation.folded:
                assert operation.family is not None
                nodes.append(self._folded(operation.family, operation.folded, leaves, depth))
            elif operation.code == ca.OP_PARAMETER:
                nodes.append(self._leaf(operation.expression.name(), leaves, depth))
            elif _is_absorbed(found, operation):
                nodes.append(None)
            elif operation.family:
                nodes.append(self._chain(found, nodes, place, operation.family))
            else:
                nodes.append(self._single(found, operation, nodes))
        result = nodes[-1]
        assert result is not None  # nothing uses it, so it is not absorbed
        return result

    def _leaf(self, name: str, leaves: Leaves, depth: int) -> Node:
        place = total_place(name)
        if place is None:
            return leaves(name)
        if (place, depth) not in self._totals:
            total = self._columns.total(place)
            assert total is not None
            self._totals[place, depth] = self._total(total, depth)
        return self._totals[place, depth]

    def _total(self, total: Total, depth: int) -> Node:
        """Return the node of a total: series if it is long and regular, else all its terms."""
        columns, column = self._columns, total.column
        if len(column) >= _LONG_TOTAL and depth < len(self._letters):
            found, omitted = rows_of(columns, column)
            if is_regular(found, omitted):
                folded = Folded(lambda i: columns.expression(int(column[i])), found)
                return self._folded(FAMILIES[total.code], folded, self._fixed, depth)
        return self.lower(columns.chain(total), self._fixed, depth)

    def _chain(
        self, found: list[Operation], nodes: list[Node | None], end: int, family: Family
    ) -> Node:
        """Return the node of a whole chain from its last link."""
        parts: list[tuple[int, Node]] = []
        stack = [(1, end)]
        while stack:
            sign, at = stack.pop()
            node = nodes[at] if at != end else None
            if node is not None:
                parts += _terms(sign, node) if _is_link(found[at], node, family) else [(sign, node)]
                continue
            code = found[at].code
            signs = {ca.OP_SUB: (sign, -sign), ca.OP_NEG: (-sign,)}.get(code, (sign, sign))
            stack.extend(reversed(list(zip(signs, found[at].args, strict=True))))
        return self._combined(family, parts)

    def _combined(self, family: Family, parts: list[tuple[int, Node]]) -> Node:
        """Return terms (with signs), factors, … under their operator."""
        args = [node for _, node in parts]
        match family:
            case "sum":
                return self._algebra.sum(parts)
            case "product":
                return self._algebra.product(args)
            case "min" | "max":
                return self._algebra.extreme(family, args)
            case "and" | "or":
                return self._algebra.together(family, args)

    def _folded(self, family: Family, folded: Folded, leaves: Leaves, depth: int) -> Node:
        """Return the node of a folded chain: series, and what is before and after them."""
        parts: list[Node] = []
        for row in folded.rows:
            if len(row.indices) >= SHORTEST:
                parts.append(self._series(family, row, leaves, depth))
            else:
                elements = (folded.element(i) for i in row.indices)
                parts.extend(self.lower(element, leaves, depth) for element in elements)
        return self._combined(family, [(1, part) for part in parts])

    def _series(self, family: Family, row: Row, leaves: Leaves, depth: int) -> Node:
        letter = self._letters[depth]
        offsets = {leaf: leaf.index - row.base for leaf in row.moving}
        shift = min(offsets.values(), key=lambda offset: (abs(offset), offset), default=0)
        numbers = {leaf.name: offset - shift for leaf, offset in offsets.items()}

        def running(name: str) -> Node:
            shared = row.shared.get(name)
            if isinstance(shared, Progression):
                return progression(self._algebra, shared, letter, shift)
            if shared is not None:
                return self.lower(shared, leaves, depth + 1)
            shown = leaves(name)
            number = numbers.get(name)
            if number is None or not isinstance(shown.value, Symbol):
                return shown
            return self._algebra.symbol(Symbol(shown.value.name, number, letter))

        body = self.lower(row.expression, running, depth + 1)
        first, last = row.indices[0] + 1 + shift, row.indices[-1] + 1 + shift
        return series(self._algebra, Running(family, letter, first, last), body)

    def _single(
        self, found: list[Operation], operation: Operation, nodes: list[Node | None]
    ) -> Node:
        """Return the node of an operation that does not chain."""
        code, expression = operation.code, operation.expression
        args = [node for node in (nodes[i] for i in operation.args) if node is not None]
        if code == ca.OP_CONST:
            return self._algebra.number(float(expression))
        if code in _NAMES:
            return self._algebra.call(_NAMES[code], args)
        if code in _OTHERS:
            return _OTHERS[code](self._algebra, *args)
        if expression.is_call():
            return self._algebra.call(f"call {expression.which_function().name()}", args)
        if expression.is_output():
            called = found[operation.args[0]].expression.which_function()
            if sum(called.nnz_out(i) for i in range(called.n_out())) == 1:
                return args[0]
            number = expression.which_output() + 1
            return self._algebra.call(f"call {called.name()}_{number}", args[0].args)
        raise UnprintableError


def progression(algebra: Algebra, found: Progression, letter: str, shift: int = 0) -> Node:
    """Return a progression by a letter that is element i's number i (from 1) plus the shift."""
    start = found.start - found.step * (1 + shift)
    index = algebra.symbol(Symbol("", 0, letter))
    grown = algebra.product([algebra.number(found.step), index])
    return algebra.sum([(1, grown), (1, algebra.number(start))])


def _is_link(operation: Operation, node: Node, family: Family) -> bool:
    """Return whether an operation is a total that continues the chain it is used in."""
    is_total = operation.code == ca.OP_PARAMETER and operation.uses == 1
    return is_total and node.kind == family and total_place(operation.expression.name()) is not None


def _terms(sign: int, node: Node) -> list[tuple[int, Node]]:
    """Return the terms of a sum with their signs, or the arguments of another operator."""
    return [(-sign, a.args[0]) if a.kind == "negative" else (sign, a) for a in node.args]


def _is_absorbed(found: list[Operation], operation: Operation) -> bool:
    """Return whether an operation is an inner link of a chain."""
    return (
        operation.family is not None
        and operation.uses == 1
        and found[operation.user].family == operation.family
    )


_OTHERS: dict[int, Callable[..., Node]] = {
    ca.OP_ASSIGN: lambda algebra, a: a,
    ca.OP_LIFT: lambda algebra, a, _: a,
    ca.OP_PRINTME: lambda algebra, a, _: a,
    ca.OP_DIV: lambda algebra, a, b: algebra.quotient(a, b),
    ca.OP_POW: lambda algebra, a, b: algebra.power(a, b),
    ca.OP_CONSTPOW: lambda algebra, a, b: algebra.power(a, b),
    ca.OP_INV: lambda algebra, a: algebra.quotient(algebra.one, a),
    ca.OP_SQ: lambda algebra, a: algebra.product([a, a]),
    ca.OP_TWICE: lambda algebra, a: algebra.product([algebra.number(2.0), a]),
    ca.OP_LT: lambda algebra, a, b: algebra.compare("<", a, b),
    ca.OP_LE: lambda algebra, a, b: algebra.compare("≤", a, b),
    ca.OP_EQ: lambda algebra, a, b: algebra.compare("=", a, b),
    ca.OP_NE: lambda algebra, a, b: algebra.compare("≠", a, b),
    ca.OP_NOT: lambda algebra, a: algebra.negation(a),
    ca.OP_IF_ELSE_ZERO: lambda algebra, c, a: algebra.cases(c, a, algebra.zero),
    ca.OP_LOG1P: lambda algebra, a: algebra.call("ln", [algebra.sum([(1, algebra.one), (1, a)])]),
    ca.OP_EXPM1: lambda algebra, a: algebra.sum([(1, algebra.call("exp", [a])), (-1, algebra.one)]),
    ca.OP_HYPOT: lambda algebra, a, b: algebra.call(
        "sqrt", [algebra.sum([(1, algebra.product([a, a])), (1, algebra.product([b, b]))])]
    ),
}  # fmt: skip
