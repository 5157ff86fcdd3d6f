"""Long regular sums (minima, …) as series: x₁ + x₂ + … + xₙ becomes ∑ xₖ."""

from collections.abc import Sequence

from .nodes import Kind, Node, Nodes, Running, Symbol, reachable

SHORTEST = 5  # terms, from which on a series is easier to read than its terms
_HEAVIEST = 400  # nodes of one term: heavier ones are not compared


def with_series(nodes: Nodes, operator: Kind, args: Sequence[Node], letter: str) -> list[Node]:
    """Return the operator's arguments with each long regular run replaced by a series.

    Regular is a run in which every argument differs from the one before by the next element of
    some vectors, and by nothing else. Without a letter to run over there are no series.
    """
    if not letter:
        return list(args)
    found: list[Node] = []
    place = 0
    while place < len(args):
        template, length = _run(nodes, args, place, letter)
        if template is None:
            found.append(args[place])
        else:
            first = _first_number(template, letter)
            body = _moved(nodes, template, letter, letter, -first)
            found.append(series(nodes, Running(operator, letter, first, first + length - 1), body))
        place += length
    return found


def series(nodes: Nodes, running: Running, body: Node) -> Node:
    """Return a series; a sum of what is negative is the negative of a sum."""
    if running.operator == "sum" and body.kind == "negative":
        return nodes.node("negative", [nodes.node("series", body.args, running)])
    return nodes.node("series", [body], running)


def _run(nodes: Nodes, args: Sequence[Node], place: int, letter: str) -> tuple[Node | None, int]:
    """Return a template of the arguments from a place on and how many it makes, or None and 1.

    The template's running symbols hold their number in the first of these arguments.
    """
    if len(args) - place < SHORTEST or args[place].weight > _HEAVIEST:
        return None, 1
    template = _template(nodes, args[place], args[place + 1], letter)
    if template is None or template is args[place]:
        return None, 1
    length = 2
    while place + length < len(args):
        if _moved(nodes, template, letter, "", length) is not args[place + length]:
            break
        length += 1
    return (template, length) if length >= SHORTEST else (None, 1)


def _template(nodes: Nodes, a: Node, b: Node, letter: str) -> Node | None:
    """Return `a` with running symbols where `b` has the next element, None if more differs."""
    if a is b:
        return a
    x, y = a.value, b.value
    if isinstance(x, Symbol) and isinstance(y, Symbol):
        if x.number is None or x.letter or y != Symbol(x.name, x.number + 1):
            return None
        return nodes.node("symbol", value=Symbol(x.name, x.number, letter))
    if (a.kind, x, len(a.args)) != (b.kind, y, len(b.args)) or a.kind == "series":
        return None  # the letter of a series inside would stand for two things
    args = [_template(nodes, p, q, letter) for p, q in zip(a.args, b.args, strict=True)]
    known = [p for p in args if p is not None]
    return nodes.again(a, known) if known and len(known) == len(args) else None


def _moved(nodes: Nodes, template: Node, letter: str, to: str, by: int) -> Node:
    """Return the template with its running symbols' numbers moved and their letter replaced."""
    s = template.value
    if isinstance(s, Symbol):
        if s.letter != letter or s.number is None:
            return template
        return nodes.node("symbol", value=Symbol(s.name, s.number + by, to))
    if not template.args:
        return template
    return nodes.again(template, [_moved(nodes, a, letter, to, by) for a in template.args])


def _first_number(template: Node, letter: str) -> int:
    """Return the number of the template's first running symbol."""
    symbols = (n.value for n in reachable([template]) if isinstance(n.value, Symbol))
    return next(s.number for s in symbols if s.letter == letter and s.number is not None)
