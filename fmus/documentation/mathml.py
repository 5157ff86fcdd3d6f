"""Nodes -> presentation MathML, which browsers typeset themselves."""

from html import escape

from .definitions import LINE, Widths
from .naming import has_letter, identifier, number_mathml
from .nodes import Node, Running, Symbol

_OR, _AND, _NOT, _COMPARE, _SUM, _PRODUCT, _POWER, _ATOM = range(8)
_LEVELS = {
    "or": _OR, "and": _AND, "not": _NOT, "compare": _COMPARE, "cases": _OR,
    "sum": _SUM, "negative": _SUM, "series": _SUM, "product": _PRODUCT, "power": _POWER,
    "quotient": _POWER,
}  # fmt: skip
_MOST_LINES = 12  # of a sum
_TIMES, _INVISIBLE_TIMES = "<mo>⋅</mo>", "<mo>&#8290;</mo>"
_APPLY = "<mo>&#8289;</mo>"
_BRACKETS = {"abs": "||", "floor": "⌊⌋", "ceil": "⌈⌉"}
_OPERATORS = {"and": "∧", "or": "∨"}


def mathml(node: Node, level: int = _OR) -> str:
    """Return a node's MathML, in parentheses if it binds weaker than the level demands."""
    text = _KINDS[node.kind](node)
    return _fenced(text) if _level(node) < level else text


def math(content: str, *, display: bool = False) -> str:
    """Return a whole <math> element, typeset as on a line of its own (`display`) or in text."""
    style = ' displaystyle="true"' if display else ""
    return f"<math{style}>{content}</math>"


def rows(node: Node) -> list[str]:
    """Return the MathML of an expression broken into lines where it is a long sum."""
    widths = Widths()
    if node.kind != "sum" or widths.of(node) <= LINE:
        return [mathml(node)]
    lines: list[list[Node]] = [[]]
    filled = 0
    for term in node.args:
        width = widths.of(term) + 3
        if lines[-1] and filled + width > LINE:
            lines.append([])
            filled = 0
        lines[-1].append(term)
        filled += width
    shown = [_sum(line, leading=i == 0) for i, line in enumerate(lines)]
    if len(shown) > _MOST_LINES:
        omitted = sum(len(line) for line in lines[_MOST_LINES - 2 : -1])
        more = f"<mrow><mo>+</mo><mtext>… ({omitted} terms left out)</mtext></mrow>"
        shown[_MOST_LINES - 2 : -1] = [more]
    return shown


def derivative(symbol: str, time: str) -> str:
    """Return the MathML of a symbol's time derivative."""
    d = '<mi mathvariant="normal">d</mi>'
    return f'<mfrac>{d}<mrow>{d}{time}</mrow></mfrac><mspace width="0.2em"/>{symbol}'


def symbol_mathml(symbol: Symbol) -> str:
    """Return a symbol's MathML, its index as a subscript."""
    if symbol.number is None:
        return identifier(symbol.name)
    if not symbol.name:  # the running number itself
        return _index(symbol.letter, symbol.number)
    if symbol.auxiliary:
        indices = [f"<mn>{symbol.number}</mn>", *(f"<mi>{a}</mi>" for a in symbol.letter)]
        return identifier(symbol.name, f"<mrow>{'<mo>,</mo>'.join(indices)}</mrow>")
    return identifier(symbol.name, _index(symbol.letter, symbol.number))


def _index(letter: str, number: int) -> str:
    if not letter:
        return f"<mn>{number}</mn>"
    if number == 0:
        return f"<mi>{letter}</mi>"
    sign = "+" if number > 0 else "−"
    return f"<mrow><mi>{letter}</mi><mo>{sign}</mo><mn>{abs(number)}</mn></mrow>"


def _level(node: Node) -> int:
    if node.kind == "number":
        text = number_mathml(node.value) if isinstance(node.value, float) else ""
        if text.startswith("<mfrac"):
            return _POWER
        return _PRODUCT if text.startswith("<mrow") else _POWER if "<msup" in text else _ATOM
    if isinstance(node.value, Symbol) and not node.value.name and node.value.number:
        return _SUM
    return _LEVELS.get(node.kind, _ATOM)


def _fenced(text: str, brackets: str = "()") -> str:
    left, right = brackets
    return (
        f'<mrow><mo fence="true" form="prefix">{left}</mo>{text}'
        f'<mo fence="true" form="postfix">{right}</mo></mrow>'
    )


def _symbol(node: Node) -> str:
    assert isinstance(node.value, Symbol)
    return symbol_mathml(node.value)


def _number(node: Node) -> str:
    assert isinstance(node.value, float)
    return number_mathml(node.value)


def _sum(terms: tuple[Node, ...] | list[Node], *, leading: bool = True) -> str:
    """Return terms with their signs; `leading` leaves out a first plus."""
    pieces = []
    for place, term in enumerate(terms):
        if term.kind == "negative":
            pieces.append(f"<mo>−</mo>{mathml(term.args[0], _PRODUCT)}")
        elif place or not leading:
            pieces.append(f"<mo>+</mo>{mathml(term, _SUM)}")
        else:
            pieces.append(mathml(term, _SUM))
    return f"<mrow>{''.join(pieces)}</mrow>"


def _negative(node: Node) -> str:
    return f"<mrow><mo>−</mo>{mathml(node.args[0], _PRODUCT)}</mrow>"


def _product(node: Node) -> str:
    pieces = [mathml(node.args[0], _PRODUCT)]
    for before, after in zip(node.args, node.args[1:], strict=False):
        close = before.kind == "number" and _is_letter(after)
        pieces.append(_INVISIBLE_TIMES if close else _TIMES)
        pieces.append(mathml(after, _PRODUCT))
    return f"<mrow>{''.join(pieces)}</mrow>"


def _is_letter(node: Node) -> bool:
    """Return whether a node is typeset as one letter, be it with a subscript or a power."""
    if node.kind == "power":
        return _is_letter(node.args[0])
    return isinstance(node.value, Symbol) and has_letter(node.value.name)


def _quotient(node: Node) -> str:
    above, below = (mathml(a) for a in node.args)
    return f"<mfrac>{above}{below}</mfrac>"


def _power(node: Node) -> str:
    return f"<msup>{mathml(node.args[0], _ATOM)}{mathml(node.args[1])}</msup>"


def _call(node: Node) -> str:
    name = str(node.value)
    if name == "sqrt":
        return f"<msqrt>{mathml(node.args[0])}</msqrt>"
    if name in _BRACKETS:
        return _fenced(mathml(node.args[0]), _BRACKETS[name])
    return _applied(escape(name.removeprefix("call ")), node)


def _applied(name: str, node: Node) -> str:
    args = "<mo>,</mo>".join(mathml(a) for a in node.args)
    return f'<mrow><mi mathvariant="normal">{name}</mi>{_APPLY}{_fenced(args)}</mrow>'


def _extreme(node: Node) -> str:
    return _applied(node.kind, node)


def _compare(node: Node) -> str:
    left, right = (mathml(a, _SUM) for a in node.args)
    sign = escape(str(node.value))
    return f"<mrow>{left}<mo>{sign}</mo>{right}</mrow>"


def _logic(node: Node) -> str:
    sign = f"<mo>{_OPERATORS[node.kind]}</mo>"
    return f"<mrow>{sign.join(mathml(a, _NOT) for a in node.args)}</mrow>"


def _not(node: Node) -> str:
    return f"<mrow><mo>¬</mo>{mathml(node.args[0], _ATOM)}</mrow>"


def _cases(node: Node) -> str:
    lines = []
    for value, condition in zip(node.args[::2], node.args[1::2], strict=False):
        lines.append((mathml(value), f"<mrow><mtext>if&#160;</mtext>{mathml(condition)}</mrow>"))
    lines.append((mathml(node.args[-1]), "<mtext>otherwise</mtext>"))
    table = "".join(f"<mtr><mtd>{a}</mtd><mtd>{b}</mtd></mtr>" for a, b in lines)
    brace = '<mo fence="true" form="prefix" stretchy="true">{</mo>'
    style = 'class="cases" columnalign="left" displaystyle="true"'
    return f"<mrow>{brace}<mtable {style}>{table}</mtable></mrow>"


def _series(node: Node) -> str:
    running = node.value
    assert isinstance(running, Running)
    sign = {"sum": "∑", "and": "⋀", "or": "⋁"}.get(running.operator, running.operator)
    tag, apply = ("mo", "") if len(sign) == 1 else ("mi", _APPLY)
    start = f"<mrow><mi>{running.letter}</mi><mo>=</mo><mn>{running.first}</mn></mrow>"
    body = mathml(node.args[0], _PRODUCT)
    return (
        f"<mrow><munderover><{tag}>{sign}</{tag}>{start}<mn>{running.last}</mn></munderover>"
        f"{apply}{body}</mrow>"
    )


_KINDS = {
    "number": _number, "symbol": _symbol, "sum": lambda node: _sum(node.args),
    "negative": _negative, "product": _product, "quotient": _quotient, "power": _power,
    "call": _call, "cases": _cases, "compare": _compare, "and": _logic, "or": _logic,
    "not": _not, "min": _extreme, "max": _extreme, "series": _series,
}  # fmt: skip
