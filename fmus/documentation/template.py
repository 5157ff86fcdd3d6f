"""One element of a column as a pattern that other elements may follow."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

_FEW = 6  # with more different elements than this, a vector counts as used as a whole
FARTHEST = 2  # neighbours that an element may use as "i − 2"

# What comparing one column may cost: about 0.1 s.
_LARGEST = 200_000  # operations
_LARGEST_CSE = 40_000  # operations, where CasADi must look for equal subexpressions
_LARGEST_TREES = 2_000_000  # operations, those in shared subexpressions counted repeatedly


@dataclass(frozen=True)
class Leaf:
    """Element `index` (from 0) of argument number `argument`."""

    argument: int
    index: int

    @classmethod
    def named(cls, name: str) -> "Leaf":
        """Return the leaf of a symbol of `arguments`; raise ValueError for another symbol."""
        argument, _, index = name.partition("_")
        return cls(int(argument), int(index or 0))

    @property
    def name(self) -> str:
        """The name of its symbol; arguments are vectors."""
        return f"{self.argument}_{self.index}"


def arguments(lengths: Sequence[int]) -> list[ca.SX]:
    """Return symbols of these lengths, whose names `Leaf.named` understands."""
    return [ca.SX.sym(str(k), length) for k, length in enumerate(lengths)]


class Template:
    """The expression of element `base`; `shared` says what symbols stand for that are no leaves."""

    def __init__(self, expression: ca.SX, base: int, shared: Mapping[str, ca.SX]) -> None:
        self._symbols = ca.symvar(expression)
        self._base = base
        self._shared = shared
        self._function = ca.Function("element", self._symbols, [expression])
        self._calls = False
        weights: dict[int, int] = {}  # as a tree, in which what is shared stands repeatedly
        for k in range(self._function.n_instructions()):
            code = self._function.instruction_id(k)
            if code == ca.OP_OUTPUT:
                continue
            self._calls = self._calls or code == ca.OP_CALL
            used = () if code == ca.OP_INPUT else self._function.instruction_input(k)
            weight = 1 + sum(weights[i] for i in used)
            weights.update(dict.fromkeys(self._function.instruction_output(k), weight))
        self._weight = max(weights.values(), default=1)

    def _needs_cse(self, count: int) -> bool:
        # is_equal compares trees, and takes two calls of one function for different.
        return self._calls or self._weight * count > _LARGEST_TREES

    def is_too_large(self, count: int) -> bool:
        """Return whether comparing `count` elements would take too long."""
        limit = _LARGEST_CSE if self._needs_cse(count) else _LARGEST
        return self._function.n_instructions() * count > limit

    def moving(self, inputs: Sequence[ca.SX], reach: int) -> frozenset[Leaf]:
        """Return the leaves that are taken to move with the element: near it, and in a vector."""
        leaves = [leaf for leaf in map(_leaf, self._symbols) if leaf]
        counts: dict[int, int] = {}
        for leaf in leaves:
            counts[leaf.argument] = counts.get(leaf.argument, 0) + 1
        return frozenset(
            leaf
            for leaf in leaves
            if inputs[leaf.argument].numel() > 1
            and counts[leaf.argument] <= _FEW
            and abs(leaf.index - self._base) <= reach
        )

    def followers(
        self, column: ca.SX, inputs: Sequence[ca.SX], moving: frozenset[Leaf]
    ) -> list[int]:
        """Return the places of all elements that are this one with its moving leaves moved."""
        base = self._base
        low = max((base - leaf.index for leaf in moving), default=0)
        highs = (inputs[m.argument].numel() - m.index + base for m in moving)
        start, stop = max(low, 0), min((*highs, column.numel()))
        pieces: list[ca.SX] = []
        for symbol in self._symbols:
            leaf = _leaf(symbol)
            if leaf is None:
                pieces.append(self._shared.get(symbol.name(), symbol))
            elif leaf in moving:
                shift = leaf.index - base
                pieces.append(inputs[leaf.argument][start + shift : stop + shift].T)
            else:
                pieces.append(symbol)
        row = self._function.call(pieces)[0]
        expected = ca.vertcat(*[row] * (stop - start)) if row.is_scalar() else row.T
        found = self._equal(column[start:stop], expected, base - start)
        return [start + k for k in found]

    def _equal(self, a: ca.SX, b: ca.SX, base: int) -> list[int]:
        """Return the places at which two columns hold the same expressions, the base is one.

        If none of its neighbours is one, the others are not looked at.
        """
        size, depth = a.numel(), 1_000_000
        if self._needs_cse(size):
            a, b = ca.cse([a, b])
            depth = 0
        if not any(
            ca.is_equal(a[k], b[k], depth)
            for k in range(max(0, base - FARTHEST), min(size, base + FARTHEST + 1))
            if k != base
        ):
            return [base]
        found: list[int] = []
        stack = [(0, size)]
        while stack:
            start, stop = stack.pop()
            if ca.is_equal(a[start:stop], b[start:stop], depth):
                found.extend(range(start, stop))
            elif stop - start > 1:
                middle = (start + stop) // 2
                stack += [(middle, stop), (start, middle)]
        return found


def _leaf(symbol: ca.SX) -> Leaf | None:
    try:
        return Leaf.named(symbol.name())
    except ValueError:
        return None
