"""Abbreviations for the parts of an expression that would not fit a line."""

from collections import Counter
from dataclasses import replace

from .nodes import CONDITIONS, Node, Nodes, Running, Symbol, reachable

LINE = 100  # characters, about
_WORTHWHILE = 14  # what is repeated gets a symbol from this width on
_IN_ROWS = ("sum", "cases")  # these can be broken into several lines
_SIMPLE = ("symbol", "number")
_KEPT = (*_SIMPLE, *CONDITIONS, "negative")  # not worth a symbol for being repeated

Definition = tuple[Node, Node]  # a symbol and what it stands for


class Widths:
    """Widths of typeset nodes in characters, roughly."""

    def __init__(self) -> None:
        self._known: dict[Node, int] = {}

    def of(self, root: Node) -> int:
        """Return the width of a node."""
        for node in reachable([root]) if root not in self._known else ():
            if node not in self._known:
                self._known[node] = self._width(node)
        return self._known[root]

    def _width(self, node: Node) -> int:
        args = [self._known[a] for a in node.args]
        if node.kind == "number":
            return len(f"{node.value:.6g}")
        if isinstance(node.value, Symbol):
            return len(node.value.name) + (1 if node.value.number else 0)
        if node.kind == "quotient":
            return max(args) + 1
        if node.kind == "cases":
            rows = zip(args[::2], [*args[1::2], 3], strict=True)
            return max(value + condition for value, condition in rows) + 6
        between = 2 if node.kind == "product" else 0 if node.kind == "power" else 3
        return sum(args) + between * max(1, len(args) - 1) + (4 if node.kind == "call" else 0)


def abbreviated(nodes: Nodes, root: Node, letter: str) -> tuple[Node, list[Definition]]:
    """Return an expression and the definitions of the symbols that shorten it.

    A symbol is the letter with a number, in the order of appearance. Cases inside something else
    always get one. What depends on a running letter gets one with this letter as an index.
    """
    shortening = _Shortening(nodes, letter)
    short = shortening.of(root)
    return shortening.in_reading_order(short)


class _Shortening:
    """The definitions of one expression, as they are found: from the inside to the outside."""

    def __init__(self, nodes: Nodes, letter: str) -> None:
        self._nodes = nodes
        self._letter = letter
        self._widths = Widths()
        self._definitions: list[Definition] = []
        self._running: dict[Node, frozenset[str]] = {}

    def of(self, root: Node) -> Node:
        """Return the shortened expression."""
        fits = self._widths.of(root) <= LINE
        uses = Counter(a for node in reachable([root]) for a in node.args)
        short: dict[Node, Node] = {}
        for node in reachable([root]):
            fitted = self._fitted(node, [short[a] for a in node.args])
            repeated = uses[node] > 1 and node.kind not in _KEPT and not fits
            worthwhile = repeated and self._widths.of(fitted) >= _WORTHWHILE
            inner = node.kind == "cases" and node is not root
            short[node] = self._defined(fitted) if worthwhile or inner else fitted
        return short[root]

    def _fitted(self, node: Node, args: list[Node]) -> Node:
        """Return the node of shortened arguments, the widest of them defined until it fits."""
        fitted = self._nodes.again(node, args)
        for i in sorted(range(len(args)), key=lambda i: -self._widths.of(args[i])):
            wide = self._widths.of(args[i] if node.kind in _IN_ROWS else fitted) > LINE
            if not wide or args[i].kind in _SIMPLE:
                break
            args = [self._defined(a) if a is args[i] else a for a in args]
            fitted = self._nodes.again(node, args)
        return fitted

    def _defined(self, node: Node) -> Node:
        """Return the symbol that stands for a node from now on."""
        for symbol, known in self._definitions:
            if known is node:
                return symbol
        letters = "".join(sorted(self._letters_of(node)))
        number = len(self._definitions) + 1
        symbol = self._nodes.node("symbol", value=Symbol(self._letter, number, letters, True))
        self._definitions.append((symbol, node))
        return symbol

    def _letters_of(self, root: Node) -> frozenset[str]:
        """Return the letters of series that an expression depends on from outside itself."""
        for node in reachable([root]):
            letters = frozenset().union(*(self._running[a] for a in node.args))
            if isinstance(node.value, Symbol):
                letters = frozenset(node.value.letter)
            if isinstance(node.value, Running):
                letters -= {node.value.letter}
            self._running[node] = letters
        return self._running[root]

    def in_reading_order(self, root: Node) -> tuple[Node, list[Definition]]:
        """Return the expression and its definitions, numbered as a reader meets them."""
        meanings = dict(self._definitions)
        met: dict[Node, Node] = {}
        trees = [root]
        for tree in trees:  # grows
            for node in reachable([tree]):
                if node in meanings and node not in met:
                    assert isinstance(node.value, Symbol)
                    number = replace(node.value, number=len(met) + 1)
                    met[node] = self._nodes.node("symbol", value=number)
                    trees.append(meanings[node])
        short, *defined = [self._replaced(tree, met) for tree in trees]
        return short, list(zip(met.values(), defined, strict=True))

    def _replaced(self, root: Node, new: dict[Node, Node]) -> Node:
        found: dict[Node, Node] = {}
        for node in reachable([root]):
            again = self._nodes.again(node, [found[a] for a in node.args])
            found[node] = new.get(node, again)
        return found[root]
