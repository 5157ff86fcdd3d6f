"""CasADi functions as loops: `loops_of` follows a function, instruction by instruction."""

import math
from collections.abc import Sequence

import casadi as ca
import numpy as np

from .loops import Codes, Loops, UnsupportedError

_OF_ONE = (
    "exp", "log", "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh",
    "asinh", "acosh", "atanh", "floor", "ceil", "fabs", "erf", "log1p", "expm1",
)  # fmt: skip
_OF_TWO = ("pow", "fmod", "copysign", "atan2", "hypot", "remainder")
# How CasADi's C spells each operation, but for `smaller` and `larger`: see `evaluation`.
OPERATIONS: dict[int, str] = {
    ca.OP_ASSIGN: "{0}", ca.OP_LIFT: "{0}", ca.OP_NEG: "-{0}", ca.OP_NOT: "!{0}",
    ca.OP_INV: "1.0 / {0}", ca.OP_SQ: "{0} * {0}", ca.OP_TWICE: "2.0 * {0}",
    ca.OP_SIGN: "{0} < 0.0 ? -1.0 : {0} > 0.0 ? 1.0 : {0}",
    ca.OP_ADD: "{0} + {1}", ca.OP_SUB: "{0} - {1}", ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}", ca.OP_CONSTPOW: "pow({0}, {1})",
    ca.OP_LT: "{0} < {1}", ca.OP_LE: "{0} <= {1}", ca.OP_EQ: "{0} == {1}",
    ca.OP_NE: "{0} != {1}", ca.OP_AND: "{0} && {1}", ca.OP_OR: "{0} || {1}",
    ca.OP_IF_ELSE_ZERO: "{0} ? {1} : 0.0",
    ca.OP_FMIN: "smaller({0}, {1})", ca.OP_FMAX: "larger({0}, {1})",
    **{getattr(ca, f"OP_{name.upper()}"): f"{name}({{0}})" for name in _OF_ONE},
    **{getattr(ca, f"OP_{name.upper()}"): f"{name}({{0}}, {{1}})" for name in _OF_TWO},
}  # fmt: skip
# Sums and the like over a vector's elements, with what they start from.
_SUMS: dict[int, tuple[str, float]] = {
    ca.OP_DOT: ("{sum} + {0} * {1}", 0.0),
    ca.OP_MMAX: ("larger({sum}, {0})", -math.inf),
    ca.OP_MMIN: ("smaller({sum}, {0})", math.inf),
    ca.OP_NORM1: ("{sum} + fabs({0})", 0.0),
    ca.OP_NORMINF: ("larger({sum}, fabs({0}))", 0.0),
}
_PRODUCTS = 64  # elements of a matrix product, each a sum
_NONE: Codes = np.empty(0, np.int64)


def loops_of(function: ca.Function, names: Sequence[str], arguments: Sequence[Codes]) -> Loops:
    """Return the loops of a function with one result, its arguments given as codes.

    Raise UnsupportedError for what has no such form.
    """
    loops = Loops(names)
    loops.finish(trace(loops, function, arguments)[0])
    return loops


def trace(loops: Loops, function: ca.Function, arguments: Sequence[Codes]) -> list[Codes]:
    """Add the lines of a function; return its results as codes.

    Raise UnsupportedError for what has no such form.
    """
    return _Tracer(loops).call(function, arguments)


class _Tracer:
    def __init__(self, loops: Loops) -> None:
        self.loops = loops

    def call(self, function: ca.Function, arguments: Sequence[Codes]) -> list[Codes]:
        """Return the results of a call."""
        kind = function.class_name()
        if kind == "MXFunction":
            return self._matrix_function(function, arguments)
        if kind == "SXFunction":
            return self._repeated(function, function, arguments, 1)
        if kind not in ("Map", "MapSum"):
            raise UnsupportedError
        inner = function.get_function(function.get_function()[0])
        if inner.class_name() != "SXFunction":
            raise UnsupportedError
        ends = [(function.size2_in(i), inner.size2_in(i)) for i in range(inner.n_in())]
        ends += [(function.size2_out(i), inner.size2_out(i)) for i in range(inner.n_out())]
        count = max(many // one for many, one in ends if one)
        if count == 1:  # all is shared or summed: how often, the sizes do not tell
            raise UnsupportedError
        return self._repeated(function, inner, arguments, count)

    def _repeated(
        self, function: ca.Function, inner: ca.Function, arguments: Sequence[Codes], count: int
    ) -> list[Codes]:
        """Call a scalar function `count` times.

        Arguments and results as long as one call's are shared by all calls, or summed over them.
        """
        columns = []
        for i, argument in enumerate(arguments):
            length = inner.nnz_in(i)
            last = length if function.nnz_in(i) == length else len(argument)
            columns.append([argument[j:last:length] for j in range(length)])
        found = []
        for i, results in enumerate(self._scalar_function(inner, columns, count)):
            if count > 1 and function.nnz_out(i) == len(results):
                zero = self.loops.constant([0.0])
                sums = [self.loops.add("{sum} + {0}", [r], count, zero) for r in results]
                found.append(_joined(sums))
            else:
                full = [np.repeat(r, count) if len(r) == 1 else r for r in results]
                found.append(np.stack(full, axis=1).ravel() if full else _joined(full))
        return found

    def _scalar_function(
        self, function: ca.Function, columns: Sequence[Sequence[Codes]], count: int
    ) -> list[list[Codes]]:
        """Return a column for each element of each result of an SX function."""
        self.loops.require(function.n_instructions())
        work: dict[int, Codes] = {}
        results = [[_NONE] * function.nnz_out(i) for i in range(function.n_out())]
        for k in range(function.n_instructions()):
            operation = function.instruction_id(k)
            inputs, outputs = function.instruction_input(k), function.instruction_output(k)
            if operation == ca.OP_OUTPUT:
                results[outputs[0]][outputs[1]] = work[inputs[0]]
            elif operation == ca.OP_INPUT:
                work[outputs[0]] = columns[inputs[0]][inputs[1]]
            elif operation == ca.OP_CONST:
                work[outputs[0]] = self.loops.constant([function.instruction_constant(k)])
            else:
                work[outputs[0]] = self._operation(operation, [work[i] for i in inputs], count)
        return results

    def _operation(self, operation: int, operands: Sequence[Codes], count: int) -> Codes:
        if operation not in OPERATIONS:
            raise UnsupportedError
        return self.loops.add(OPERATIONS[operation], operands, count)

    def _matrix_function(self, function: ca.Function, arguments: Sequence[Codes]) -> list[Codes]:
        """Return the results of an MX function, each as the codes of its nonzeros."""
        work: dict[int, Codes] = {-1: _NONE}
        results: list[list[Codes]] = [[] for _ in range(function.n_out())]
        for k in range(function.n_instructions()):
            operation = function.instruction_id(k)
            inputs, outputs = function.instruction_input(k), function.instruction_output(k)
            if operation == ca.OP_OUTPUT:
                results[outputs[0]].append(work[inputs[0]])
                continue
            node = function.instruction_MX(k)
            if operation == ca.OP_INPUT:
                info = node.info()
                first = info["offset"]
                made = [arguments[info["ind"]][first : first + node.nnz()]]
            else:
                made = self._node(operation, node, [work[i] for i in inputs])
            work.update(zip(outputs, made, strict=True))
        return [_joined(pieces) for pieces in results]

    def _node(self, operation: int, node: ca.MX, operands: list[Codes]) -> list[Codes]:
        if operation == ca.OP_CALL:
            return self.call(node.which_function(), operands)
        if operation in (ca.OP_HORZSPLIT, ca.OP_VERTSPLIT):
            parts = node.info()["output"]
            ends = np.cumsum([parts.nnz_out(i) for i in range(parts.n_out())])
            return np.split(operands[0], ends[:-1])
        if operation == ca.OP_CONST:
            return [self.loops.constant(node.to_DM().nonzeros())]
        return [self._value(operation, node, operands)]

    def _value(self, operation: int, node: ca.MX, operands: list[Codes]) -> Codes:
        if operation in OPERATIONS:
            return self._operation(operation, operands, node.nnz())
        if operation in _SUMS:
            text, start = _SUMS[operation]
            if math.isinf(start) and not node.dep(0).is_dense():
                raise UnsupportedError  # its zeros count
            return self._sum(text, operands, start)
        if operation in (ca.OP_NORM2, ca.OP_NORMF):
            square = self._sum("{sum} + {0} * {0}", operands, 0.0)
            return self.loops.add("sqrt({0})", [square], 1)
        if operation == ca.OP_MTIMES:
            return self._product(node, *operands)
        return self._moved(operation, node, operands)

    def _sum(self, text: str, operands: list[Codes], start: float) -> Codes:
        first = self.loops.constant([start])
        count = len(operands[0])
        return self.loops.add(text, operands, count, first) if count else first

    def _product(self, node: ca.MX, z: Codes, x: Codes, y: Codes) -> Codes:
        """Return z + x·y of full matrices."""
        factor = node.dep(1)
        rows, inner = factor.shape
        full = all(node.dep(i).is_dense() for i in range(3))
        if not full or len(z) > _PRODUCTS or inner == 0:
            raise UnsupportedError
        sums = []
        for k in range(len(z)):
            first = k // rows * inner
            pair = [x[k % rows :: rows], y[first : first + inner]]
            text = "{sum} + {0} * {1}"
            if self.loops.are_ones(pair[0]):  # CasADi's sum is a product with ones
                text, pair = "{sum} + {0}", pair[1:]
            sums.append(self.loops.add(text, pair, inner, z[k : k + 1]))
        return _joined(sums)

    def _moved(self, operation: int, node: ca.MX, operands: list[Codes]) -> Codes:
        """Return the codes of a node that only moves numbers."""
        first = operands[0] if operands else _NONE
        if operation in (ca.OP_RESHAPE, ca.OP_SPARSITY_CAST):
            return first
        columns = all(node.dep(i).shape[1] == 1 for i in range(node.n_dep()))
        if operation == ca.OP_HORZCAT or (operation == ca.OP_VERTCAT and columns):
            return _joined(operands)
        if operation == ca.OP_HORZREPMAT:
            return np.tile(first, node.nnz() // max(len(first), 1))
        if operation == ca.OP_TRANSPOSE:
            return first[node.dep(0).sparsity().transpose()[1]]
        if operation == ca.OP_PROJECT:
            full = np.repeat(self.loops.constant([0.0]), node.numel())
            full[node.dep(0).sparsity().find()] = first
            return full[node.sparsity().find()]
        if operation in (ca.OP_GETNONZEROS, ca.OP_SETNONZEROS, ca.OP_ADDNONZEROS):
            return self._picked(operation, np.array(node.mapping().nonzeros(), np.int64), *operands)
        raise UnsupportedError

    def _picked(self, operation: int, at: Codes, first: Codes, second: Codes = _NONE) -> Codes:
        """Return elements of `first`, or it with elements set or added to; −1 stands for none."""
        if operation == ca.OP_GETNONZEROS:
            return np.append(first, self.loops.constant([0.0]))[at]
        second, at = second[at >= 0], at[at >= 0]
        if operation == ca.OP_ADDNONZEROS:
            if len(set(at)) < len(at):
                raise UnsupportedError
            second = self.loops.add("{0} + {1}", [first[at], second], len(at))
        changed = first.copy()
        changed[at] = second
        return changed


def _joined(pieces: Sequence[Codes]) -> Codes:
    return np.concatenate(pieces) if len(pieces) else _NONE
