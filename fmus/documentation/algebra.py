"""Constructors of nodes that tidy up as they go, always to what is equal in real arithmetic.

Plants are traced as they are written, so there is 0 + x and 1 · x; and CasADi spells an if-else
as a sum of two products.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Literal

from .nodes import CONDITIONS, Node, Nodes, Symbol, UnprintableError
from .series import with_series

_FLIPPED = {"<": ">", ">": "<", "≤": "≥", "≥": "≤", "=": "=", "≠": "≠"}
_NEGATED = {"<": "≥", ">": "≤", "≤": ">", "≥": "<", "=": "≠", "≠": "="}


class Algebra(Nodes):
    """Makes nodes in normal form; `letter` is the one that series run over, if there are any."""

    def __init__(self, letter: str = "") -> None:
        super().__init__()
        self.letter = letter
        self.zero = self.number(0.0)
        self.one = self.number(1.0)

    # Leaves

    def number(self, value: float) -> Node:
        """Return a number; raise UnprintableError for a NaN."""
        if math.isnan(value):
            raise UnprintableError
        number = self.node("number", value=abs(float(value)))
        return self.node("negative", [number]) if value < 0.0 else number

    def symbol(self, symbol: Symbol) -> Node:
        """Return a variable or an element of one."""
        return self.node("symbol", value=symbol)

    # Sums

    def negative(self, a: Node) -> Node:
        """Return −a."""
        a = self.arithmetic(a)
        if a is self.zero:
            return a
        return a.args[0] if a.kind == "negative" else self.node("negative", [a])

    def sum(self, terms: Iterable[tuple[int, Node]]) -> Node:
        """Return the sum of terms with their signs."""
        terms = list(terms)
        if len(terms) == 2 and terms[0] == (1, self.one) and terms[1][0] < 0:
            condition = terms[1][1]
            if condition.kind in CONDITIONS:  # 1 − c is "not c"
                return self.negation(condition)
        args = [a if sign > 0 else self.negative(a) for sign, a in self._joined(terms)]
        args = [a for a in args if a is not self.zero]
        return self._under("sum", args) if args else self.zero

    def _joined(self, terms: Sequence[tuple[int, Node]]) -> list[tuple[int, Node]]:
        """Join (a if c, else 0) + (b if not c, else 0), which is how CasADi says if-else."""
        joined: list[tuple[int, Node]] = []
        waiting: dict[tuple[int, Node], int] = {}
        for sign, a in terms:
            if not self._is_half(a):
                joined.append((sign, self.arithmetic(a)))
                continue
            place = waiting.pop((sign, self.negation(a.args[1])), None)
            if place is None:
                waiting[(sign, a.args[1])] = len(joined)
                joined.append((sign, a))
            else:
                first = joined[place][1]
                joined[place] = (sign, self.cases(first.args[1], first.args[0], a.args[0]))
        return joined

    def _is_half(self, a: Node) -> bool:
        return a.kind == "cases" and len(a.args) == 3 and a.args[2] is self.zero

    # Products

    def product(self, factors: Sequence[Node]) -> Node:
        """Return the product of the factors: numbers first, equal ones as powers."""
        conditions = [f for f in factors if f.kind in CONDITIONS]
        if conditions:
            rest = self.product([f for f in factors if f.kind not in CONDITIONS])
            return self.cases(self.together("and", conditions), rest, self.zero)
        minus = False
        numbers: list[Node] = []
        below: list[Node] = []
        powers: dict[Node, float] = {}
        for factor in factors:
            minus ^= factor.kind == "negative"
            a = factor.args[0] if factor.kind == "negative" else factor
            if a.kind == "quotient" and a.args[0] is self.one:
                below.append(a.args[1])
            elif a.kind == "number":
                numbers.append(a)
            else:
                base, exponent = _as_power(a)
                powers[base] = powers.get(base, 0.0) + exponent
        if self.zero in numbers:
            return self.zero
        args = [a for a in numbers if a is not self.one]
        args += [self._to_power(base, exponent) for base, exponent in powers.items()]
        value = self._under("product", args) if args else self.one
        if below:
            value = self.quotient(value, self.product(below))
        return self.negative(value) if minus else value

    def _to_power(self, base: Node, exponent: float) -> Node:
        return base if exponent == 1.0 else self.node("power", [base, self.number(exponent)])

    def quotient(self, a: Node, b: Node) -> Node:
        """Return a / b."""
        a, b = self.arithmetic(a), self.arithmetic(b)
        if a.kind == "negative":
            return self.negative(self.quotient(a.args[0], b))
        if b.kind == "negative":
            return self.negative(self.quotient(a, b.args[0]))
        if b is self.one or a is self.zero:
            return a
        if a.kind == "quotient":
            return self.node("quotient", [a.args[0], self.product([a.args[1], b])])
        return self.node("quotient", [a, b])

    def power(self, a: Node, b: Node) -> Node:
        """Return a to the power b."""
        a, b = self.arithmetic(a), self.arithmetic(b)
        if b is self.one:
            return a
        if b.kind == "negative":
            return self.quotient(self.one, self.power(a, b.args[0]))
        if b.kind == "number" and b.value == 0.5:
            return self.call("sqrt", [a])
        return self.node("power", [a, b])

    # Functions

    def call(self, name: str, args: Sequence[Node]) -> Node:
        """Return a function of the arguments."""
        return self.node("call", [self.arithmetic(a) for a in args], name)

    def extreme(self, kind: Literal["min", "max"], args: Sequence[Node]) -> Node:
        """Return the smallest or largest of the arguments."""
        neutral = self.number(math.inf if kind == "min" else -math.inf)
        args = [a for a in args if a is not neutral] or [neutral]
        return self._under(kind, [self.arithmetic(a) for a in args])

    def arithmetic(self, a: Node) -> Node:
        """Return a condition as the number it stands for, 1 or 0; anything else as it is."""
        return self.cases(a, self.one, self.zero) if a.kind in CONDITIONS else a

    def cases(self, condition: Node, a: Node, otherwise: Node) -> Node:
        """Return a where the condition holds, and `otherwise` where not."""
        a, otherwise = self.arithmetic(a), self.arithmetic(otherwise)
        if a is otherwise:
            return a
        more = otherwise.args if otherwise.kind == "cases" else (otherwise,)
        return self.node("cases", (a, self.condition(condition), *more))

    # Logic

    def compare(self, sign: str, a: Node, b: Node) -> Node:
        """Return a comparison, with a lone number on its right."""
        a, b = self.arithmetic(a), self.arithmetic(b)
        if _is_number(a) and not _is_number(b):
            a, b, sign = b, a, _FLIPPED[sign]
        return self.node("compare", [a, b], sign)

    def condition(self, a: Node) -> Node:
        """Return a number as the condition it stands for, a ≠ 0; a condition as it is."""
        return a if a.kind in CONDITIONS else self.compare("≠", a, self.zero)

    def negation(self, a: Node) -> Node:
        """Return not a."""
        a = self.condition(a)
        if a.kind == "not":
            return a.args[0]
        if a.kind == "compare":
            return self.node("compare", a.args, _NEGATED[str(a.value)])
        return self.node("not", [a])

    def together(self, kind: Literal["and", "or"], args: Sequence[Node]) -> Node:
        """Return "all of" (and) or "one of" (or) the conditions."""
        return self._under(kind, [self.condition(a) for a in args])

    def _under(
        self, kind: Literal["sum", "product", "min", "max", "and", "or"], args: Sequence[Node]
    ) -> Node:
        if kind != "product":
            args = with_series(self, kind, args, self.letter)
        return args[0] if len(args) == 1 else self.node(kind, args)


def _as_power(a: Node) -> tuple[Node, float]:
    """Return base and exponent; the exponent is 1 unless it is a whole number."""
    if a.kind == "power":
        exponent = a.args[1].value
        if isinstance(exponent, float) and exponent.is_integer():
            return a.args[0], exponent
    return a, 1.0


def _is_number(a: Node) -> bool:
    return a.kind == "number" or (a.kind == "negative" and a.args[0].kind == "number")
