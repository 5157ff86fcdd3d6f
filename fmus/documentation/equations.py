"""A plant's equations and events, typeset."""

from collections.abc import Callable, Mapping

import casadi as ca

from ...models.event import Event
from ...models.plant import Plant
from .expressions import Expressions, Line, Shown, spans
from .html import code, text
from .mathml import derivative, math, mathml, rows, symbol_mathml
from .naming import identifier
from .nodes import Node, Symbol

_MOST_SPANS = 4  # of a line's runs of elements
_ORDER = (
    "New values (←) are computed from all values before the event. Where several events fire at "
    "once, the one listed first goes first, and the others follow if they still hold."
)


class Equations:
    """Typesets the expressions of one plant."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._shown = Expressions(plant)
        self._sizes = {v.name: v.size for v in plant.variables()}

    def html(self) -> str:
        """Return all equations under their headings."""
        plant = self._plant
        time = f"{math(mathml(self._shown.time))} is the time in s."
        return (
            f'<p class="note">{time}</p>\n'
            + self._part("Dependent parameters", plant.dependents, self._symbol)
            + self._part("States", plant.derivatives, self._derivative)
            + self._part("Outputs", plant.outputs, self._symbol)
            + self._part("Memories, after each solver step", plant.updates, self._symbol, "←")
            + self._events()
        )

    def _part(
        self,
        heading: str,
        expressions: Mapping[str, ca.MX],
        left: Callable[[str, Line], str],
        sign: str = "=",
    ) -> str:
        if not expressions:
            return ""
        return f"<h3>{heading}</h3>\n{self._assignments(expressions, left, sign)}"

    def _assignments(
        self, expressions: Mapping[str, ca.MX], left: Callable[[str, Line], str], sign: str
    ) -> str:
        pieces = []
        for name, expression in expressions.items():
            shown = self._shown.show(expression)
            for line in shown.lines:
                start = f"{left(name, line)}<mo>{sign}</mo>"
                pieces.append(_equation(line, start, self._range(line) if line.letter else ""))
            pieces.append(_omitted(shown))
        return "".join(pieces)

    def _symbol(self, name: str, line: Line) -> str:
        if self._sizes[name] is None or line.tree is None:
            return identifier(name)
        number = 0 if line.letter else line.indices[0] + 1
        return symbol_mathml(Symbol(name, number, line.letter))

    def _derivative(self, name: str, line: Line) -> str:
        return derivative(self._symbol(name, line), mathml(self._shown.time))

    def _range(self, line: Line) -> str:
        """Return which elements a line is for: i = 1, …, n."""
        dots = "<mo>,</mo><mo>…</mo><mo>,</mo>"
        runs = list(spans(line.indices))
        shown = [
            f"<mn>{a}</mn>" if a == b
            else f"<mn>{a}</mn><mo>,</mo><mn>{b}</mn>" if b == a + 1
            else f"<mn>{a}</mn>{dots}<mn>{b}</mn>"
            for a, b in runs[:_MOST_SPANS]
        ]  # fmt: skip
        listed = "<mo>,</mo>".join(shown)
        more = f" and so on, {len(line.indices)} elements" if len(runs) > _MOST_SPANS else ""
        return f"{math(f'<mi>{self._shown.letter}</mi><mo>=</mo>{listed}')}{more}"

    # Events

    def _events(self) -> str:
        if not self._plant.events:
            return ""
        events = "".join(self._event(event) for event in self._plant.events)
        return f"<h3>Events</h3>\n<p>{_ORDER}</p>\n{events}"

    def _event(self, event: Event) -> str:
        count = f' <span class="note">one for each of {event.size} elements</span>'
        description = f"<p>{text(event.description)}</p>\n" if event.description else ""
        when = self._condition(self._shown.show(event.expression, self._meaning(event)), event)
        guard = self._guard(event)
        changes = self._assignments(event.changes, self._symbol, "←")
        return (
            f"<h4>{code(event.name)}{count if event.size > 1 else ''}</h4>\n{description}"
            f'<dl class="event">\n<dt>when</dt><dd>{when}</dd>\n'
            + (f"<dt>while</dt><dd>{guard}</dd>\n" if guard else "")
            + f"<dt>then</dt><dd>{changes}</dd>\n</dl>\n"
        )

    def _meaning(self, event: Event) -> Callable[[Node], Node]:
        """Return what makes of an event's expression the condition that becomes true."""
        algebra = self._shown.algebra
        if event.kind == "time":
            time = self._shown.time
            return lambda at: algebra.node("compare", [time, algebra.arithmetic(at)], "≥")
        if event.direction == "both":
            return algebra.arithmetic
        sign = ">" if event.direction == "rising" else "<"
        return lambda z: algebra.node("compare", [algebra.arithmetic(z), algebra.zero], sign)

    def _condition(self, shown: Shown, event: Event | None = None) -> str:
        """Return lines without a left side, each with its elements and what happens to it."""
        pieces = []
        for line in shown.lines:
            in_words = line.tree is None
            remark = _remark(event, in_words) if event else "is not 0" if in_words else ""
            elements = self._range(line) if shown.size > 1 and not in_words else ""
            pieces.append(_equation(line, "", f"{remark} {elements}".strip()))
        return "".join(pieces) + _omitted(shown)

    def _guard(self, event: Event) -> str:
        """Return the lines of an event's guard, nothing where it always holds."""
        algebra = self._shown.algebra
        always = algebra.condition(algebra.one)
        shown = self._shown.show(event.guard, algebra.condition)
        if all(line.tree is always for line in shown.lines):
            return ""
        return self._condition(shown)


def _remark(event: Event, in_words: bool) -> str:
    """Return what happens to an event's condition, or to its expression in CasADi's words."""
    if event.kind == "time":
        return "is reached by the time" if in_words else "becomes true"
    if event.direction == "both":
        return "changes its sign"
    if in_words:
        return "rises above 0" if event.direction == "rising" else "falls below 0"
    return "becomes true"


def _equation(line: Line, left: str, note: str) -> str:
    """Return a line with its left side (MathML) and the definitions it needs."""
    remark = f'<span class="note">{note}</span>' if note else ""
    if line.tree is None:
        start = math(left) if left else ""
        return f'<div class="equation">{start}{code(line.text)}{remark}</div>\n'
    content = math(_broken(left, line.tree), display=True)
    where = ""
    if line.definitions:
        pairs = [(f"{mathml(a)}<mo>=</mo>", b) for a, b in line.definitions]
        lines = "".join(f"<div>{math(_broken(a, b), display=True)}</div>" for a, b in pairs)
        where = f'<div class="where"><span>where</span><div>{lines}</div></div>'
    return f'<div class="equation">{content}{remark}{where}</div>\n'


def _broken(left: str, tree: Node) -> str:
    """Return a left side and a tree, the latter in several lines where it is a long sum."""
    first, *more = rows(tree)
    if not more:
        return f"<mrow>{left}{first}</mrow>"
    lines = [f"<mtd><mrow>{left}</mrow></mtd><mtd>{first}</mtd>"]
    lines += [f"<mtd></mtd><mtd>{line}</mtd>" for line in more]
    table = "".join(f"<mtr>{line}</mtr>" for line in lines)
    return f'<mtable class="lines" columnalign="left" displaystyle="true">{table}</mtable>'


def _omitted(shown: Shown) -> str:
    if not shown.omitted:
        return ""
    others = f"the other {shown.omitted} of {shown.size} elements"
    return f'<p class="note">The equations of {others} are left out here.</p>\n'
