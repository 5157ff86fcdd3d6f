"""A plant's expressions as rows of trees, ready to be typeset."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import casadi as ca

from ...models.expressions import exact_expressions
from ...models.plant import Plant
from ..loops import Codes
from .algebra import Algebra
from .columns import Columns
from .definitions import Definition, abbreviated
from .elements import Progression, Row, rows
from .lowering import Lowering, progression
from .naming import free_letter, free_letters
from .nodes import Node, Symbol, UnprintableError
from .patterns import rows_of
from .template import Leaf, arguments

_LONGEST_TEXT = 2000  # characters of CasADi's own words


@dataclass(frozen=True)
class Line:
    """What holds for elements `indices` (from 0): a tree and its abbreviations.

    Without a tree, `text` says the expression in CasADi's words. `letter` is the running
    element's if the line stands for several.
    """

    indices: tuple[int, ...]
    tree: Node | None = None
    definitions: tuple[Definition, ...] = ()
    text: str = ""
    letter: str = ""


@dataclass(frozen=True)
class Shown:
    """The lines of an expression of `size` elements, `omitted` of which are in none."""

    size: int
    lines: tuple[Line, ...]
    omitted: int = 0


class Expressions:
    """The expressions of one plant."""

    def __init__(self, plant: Plant) -> None:
        plant.require_complete()
        self._variables = plant.variables()
        names = [v.name for v in self._variables]
        self.letter, *series = free_letters(names, 3)
        self._abbreviation = free_letter(names)
        self.algebra = Algebra()
        clash = any(v.name == "t" for v in self._variables)
        self.time = self.algebra.symbol(Symbol("time" if clash else "t"))
        self._inputs = [plant.time, *(v.symbol for v in self._variables)]
        self._symbols = arguments([1, *(v.length for v in self._variables)])
        self._columns = Columns(self._symbols)
        self._lowering = Lowering(
            self.algebra, self._symbols, series, columns=self._columns, fixed=self._fixed
        )
        whole = list(_expressions(plant))
        with exact_expressions():
            columns = self._in_columns(whole)
            rest = [e for e, c in zip(whole, columns, strict=True) if c is None]
            scalars = self._in_scalars(rest)
        # By the expression's identity, which the plant keeps alive.
        self._codes = {e.__hash__(): c for e, c in zip(whole, columns, strict=True)}
        self._scalars = {e.__hash__(): c for e, c in zip(rest, scalars, strict=True)}

    def _in_columns(self, expressions: Sequence[ca.MX]) -> list[Codes | None]:
        """Return the expressions as columns of codes, None for each that has no such form."""
        dense = [ca.densify(e) for e in expressions]
        found = self._columns.traced(ca.Function("all", self._inputs, dense))
        if found is None and len(expressions) > 1:
            return [self._in_columns([e])[0] for e in expressions]
        return [None] if found is None else [*found]

    def _in_scalars(self, expressions: Sequence[ca.MX]) -> list[ca.SX | None]:
        """Return the expressions in scalar operations, None for each that has more."""
        if not expressions:
            return []
        try:
            return list(ca.Function("all", self._inputs, list(expressions)).call(self._symbols))
        except RuntimeError:
            if len(expressions) == 1:
                return [None]
            return [self._in_scalars([e])[0] for e in expressions]

    def show(self, expression: ca.MX, meaning: Callable[[Node], Node] | None = None) -> Shown:
        """Return what to show of one of the plant's expressions.

        `meaning` makes of its tree what is shown, a condition for example; a number by default.
        """
        meaning = meaning or self.algebra.arithmetic
        with exact_expressions():
            try:
                found, omitted = self._rows(expression)
            except UnprintableError:
                return self._in_words(expression)
            lines = tuple(self._line(row, meaning) for row in found)
        if any(line.tree is None for line in lines):
            return self._in_words(expression)
        return Shown(expression.numel(), lines, omitted)

    def _rows(self, expression: ca.MX) -> tuple[list[Row], int]:
        """Return the rows of an expression; raise UnprintableError if it has none."""
        identity = expression.__hash__()
        codes = self._codes[identity]
        if codes is not None:
            return rows_of(self._columns, codes)
        column = self._scalars[identity]
        if column is None:
            raise UnprintableError
        return rows(ca.densify(column), self._symbols)

    def _in_words(self, expression: ca.MX) -> Shown:
        text = str(expression)
        if len(text) > _LONGEST_TEXT:
            text = text[:_LONGEST_TEXT] + " …"
        size = expression.numel()
        return Shown(size, (Line(tuple(range(size)), text=text),))

    def _line(self, row: Row, meaning: Callable[[Node], Node]) -> Line:
        def leaf(name: str) -> Node:
            shared = row.shared.get(name)
            if isinstance(shared, Progression):
                return progression(self.algebra, shared, self.letter)
            if shared is not None:
                return self._lowering.lower(shared, self._fixed)
            return self._symbol(Leaf.named(name), row)

        letter = self.letter if len(row.indices) > 1 else ""
        try:
            tree = meaning(self._lowering.lower(row.expression, leaf))
            tree, definitions = abbreviated(self.algebra, tree, self._abbreviation)
        except UnprintableError:
            return Line(row.indices)
        return Line(row.indices, tree, tuple(definitions), letter=letter)

    def _fixed(self, name: str) -> Node:
        return self._symbol(Leaf.named(name), None)

    def _symbol(self, leaf: Leaf, row: Row | None) -> Node:
        """Return what is shown for a leaf, in a row whose leaves may move."""
        if leaf.argument == 0:
            return self.time
        variable = self._variables[leaf.argument - 1]
        if variable.size is None:
            symbol = Symbol(variable.name)
        elif row and leaf in row.moving:
            symbol = Symbol(variable.name, leaf.index - row.base, self.letter)
        else:
            symbol = Symbol(variable.name, leaf.index + 1)
        return self.algebra.symbol(symbol)


def spans(indices: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Yield first and last (from 1) of each run of consecutive indices (from 0)."""
    start = 0
    for k in range(1, len(indices) + 1):
        if k == len(indices) or indices[k] != indices[k - 1] + 1:
            yield indices[start] + 1, indices[k - 1] + 1
            start = k


def _expressions(plant: Plant) -> Iterator[ca.MX]:
    for found in (plant.dependents, plant.derivatives, plant.outputs, plant.updates):
        yield from found.values()
    for event in plant.events:
        yield event.expression
        yield event.guard
        yield from event.changes.values()
