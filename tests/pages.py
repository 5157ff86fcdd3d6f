"""Reads a documentation page back: its MathML, in Python's notation, evaluated and compared."""

import math
from collections.abc import Callable, Iterator
from typing import Any
from xml.etree import ElementTree as ET

import casadi as ca
import numpy as np

from railcosim.fmus.documentation import documentation_page
from railcosim.models import Plant
from railcosim.models.event import Event


def parsed(page: str) -> ET.Element:
    """Return the page as XML, which it is as well."""
    return ET.fromstring(page.replace("<!DOCTYPE html>\n", "", 1))


FUNCTIONS = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "arcsin": np.arcsin, "arccos": np.arccos,
    "arctan": np.arctan, "arctan2": np.arctan2, "sinh": np.sinh, "cosh": np.cosh,
    "tanh": np.tanh, "arsinh": np.arcsinh, "arcosh": np.arccosh, "artanh": np.arctanh,
    "exp": np.exp, "ln": np.log, "sgn": np.sign, "min": min, "max": max, "sqrt": np.sqrt,
    "absolute": abs, "floor": np.floor, "ceil": np.ceil, "fmod": np.fmod,
    "copysign": np.copysign, "remainder": math.remainder,
}  # fmt: skip
OPERATORS = {
    "⋅": "*", "\u2062": "*", "×": "*", "−": "-", "+": "+", "\u2061": "", ",": ",", "(": "(",
    ")": ")", "<": "<", ">": ">", "≤": "<=", "≥": ">=", "=": "==", "≠": "!=",
    "∧": " and ", "∨": " or ", "¬": " not ", "⌋": ")", "⌉": ")", "⌊": "floor(", "⌈": "ceil(",
}  # fmt: skip
GREEK = {"ζ": "zeta", "ω": "omega", "ρ": "rho"}
SERIES: dict[str, Callable[[Any], Any]] = {"∑": sum, "max": max, "min": min}


class Reader:
    """Translates MathML; `letters` run over elements, other unknown names are abbreviations."""

    def __init__(self, names: set[str]) -> None:
        self.names = names
        self.letters = {"i", "j", "k", "l", "n"} - names

    def text(self, element: ET.Element) -> str:
        if element.tag in ("mfrac", "msup"):
            if element.tag == "msup":
                assert self.is_tight(element[0])
            a, b = map(self.text, element)
            return f"(({a}){'/' if element.tag == 'mfrac' else '**'}({b}))"
        if element.tag in ("mi", "msub"):
            return self.name(element)
        if element.tag == "mo":
            return self.operator(element)
        if element.tag == "mn":
            return f"({element.text})"
        assert element.tag in ("mrow", "msqrt")
        content = self.row(list(element))
        return content if element.tag == "mrow" else f"sqrt({content})"

    def is_tight(self, base: ET.Element) -> bool:
        """Return whether the eye takes all of it for the base of a power."""
        if base.tag != "mrow":
            return base.tag in ("mi", "mn", "msub", "msqrt")
        fenced = base[0].get("fence") == "true" and base[-1].get("fence") == "true"
        return fenced or base[1].text in (".", "\u2061")

    def row(self, items: list[ET.Element]) -> str:
        items = [e for e in items if e.tag != "mspace"]
        if any(e.tag == "mo" and e.text == "." for e in items):
            return self.symbol(".".join(self.spelled(e) for e in items if e.tag != "mo"))
        if items[0].tag == "munderover":
            return self.series(items[0], items[1:])
        if items[0].tag == "mo" and items[0].text == "{":
            return self.cases(items[1])
        return "".join(self.text(e) for e in items)

    def operator(self, element: ET.Element) -> str:
        if element.text == "|":
            return "absolute(" if element.get("form") == "prefix" else ")"
        return OPERATORS[element.text or ""]

    def cases(self, table: ET.Element) -> str:
        rows = [(self.text(row[0][0]), row[1][0]) for row in table]
        assert rows[-1][1].text == "otherwise"
        chosen = "".join(f"({a}) if ({self.row(list(c)[1:])}) else " for a, c in rows[:-1])
        return f"({chosen}({rows[-1][0]}))"

    def series(self, sign: ET.Element, body: list[ET.Element]) -> str:
        letter, first, last = sign[1][0].text, sign[1][2].text, sign[2].text
        inner = self.row(body)
        return f"series({sign[0].text!r}, {first}, {last}, lambda {letter}: {inner})"

    def name(self, element: ET.Element) -> str:
        if element.text in ("π", "∞"):
            return {"π": "pi", "∞": "inf"}[element.text]
        if element.tag == "mi" and (element.text in FUNCTIONS or element.text in self.letters):
            return element.text or ""
        return self.symbol(self.spelled(element))

    def spelled(self, element: ET.Element) -> str:
        """Return a name as declared, with {the Python expression of its index} in braces."""
        if element.tag == "mi":
            return GREEK.get(element.text or "", element.text or "")
        head, below = element
        parts = [below]
        if below.tag == "mrow" and any(e.text == "," for e in below):
            parts = [e for e in below if e.text != ","]
        name = self.spelled(head)
        indices = []
        for part in parts:
            if part.tag == "mi" and part.text not in self.letters:
                name += f"_{GREEK.get(part.text or '', part.text)}"
            else:
                indices.append(self.text(part))
        return name + (f"{{{','.join(indices)}}}" if indices else "")

    def symbol(self, spelled: str) -> str:
        start, _, rest = spelled.partition("{")
        index, _, end = rest.partition("}")
        if start + end in self.names or f"{start}[]{end}" in self.names:
            return f"variable({start + end!r}, {index})"
        if start == "t":
            return "t"
        number_, *letters = index.split(",")
        return f"defined({number_}, {', '.join(f'{a}={a}' for a in letters)})"


class Values:
    """Random values for a plant's variables, and what expressions come to."""

    def __init__(self, plant: Plant, seed: int) -> None:
        random_ = np.random.default_rng(seed)
        self.plant = plant
        self.time = float(random_.uniform(0.0, 5.0))
        self.values = {
            v.name: random_.integers(-1, 4, v.length).astype(float)
            if v.kind == "mode"
            else random_.normal(0.0, 2.0, v.length)
            for v in plant.variables()
        }
        for v in plant.variables("dependent"):
            self.values[v.name] = self.expected(plant.dependents[v.name])

    def expected(self, expression: ca.MX) -> np.ndarray:
        variables = self.plant.variables()
        symbols = [self.plant.time, *(v.symbol for v in variables)]
        values = [self.time, *(self.values.get(v.name, 0.0) for v in variables)]
        return np.array(ca.Function("f", symbols, [expression])(*values)).ravel()

    def of(self, line: "Line", **letters: int) -> Any:
        plain = {name.replace("[]", ""): values for name, values in self.values.items()}

        def variable(name: str, index: int = 1) -> float:
            assert 1 <= index <= len(plain[name])
            return float(plain[name][index - 1])

        def series(sign: str, first: int, last: int, body: Callable[[int], float]) -> float:
            return SERIES[sign](body(k) for k in range(first, last + 1))

        scope = {**FUNCTIONS, "variable": variable, "series": series, "t": self.time,
                 "pi": np.pi, "inf": np.inf}  # fmt: skip

        def defined(number_: int, **letters: int) -> Any:
            return eval(line.definitions[number_], {**scope, "defined": defined, **letters})

        with np.errstate(all="ignore"):
            return eval(line.right, {**scope, "defined": defined, **letters})


class Line:
    """An equation of the page: what is on its left, its right in Python, for which elements."""

    def __init__(self, element: ET.Element, reader: Reader) -> None:
        left, right = self.sides(element.find("math"))
        self.left = left[-1] if left else None
        self.right = reader.row(right)
        where = element.findall("./div[@class='where']/div/div/math")
        self.definitions = {}
        for place, definition in enumerate(where, start=1):
            self.definitions[place] = reader.row(self.sides(definition)[1])
        note = element.find("span[@class='note']/math")
        parts = [] if note is None else list(note)
        self.letter = parts[0].text or "" if parts else "i"
        self.elements = [int(e.text or 0) for e in parts if e.tag == "mn"]
        if "…" in [e.text for e in parts]:
            self.elements = list(range(self.elements[0], self.elements[1] + 1))

    def sides(self, math: ET.Element | None) -> tuple[list[ET.Element], list[ET.Element]]:
        assert math is not None
        items = list(math[0])
        if math[0].tag == "mtable":  # a sum in several lines
            cells = [cell for row in items for cell in row if len(cell)]
            items = [*cells[0][0], *(e for cell in cells[1:] for e in cell[0])]
        for place, item in enumerate(items):
            if item.tag == "mo" and item.text in ("=", "←"):
                return items[:place], items[place + 1 :]
        return [], [math[0]]


def lines(block: ET.Element, reader: Reader) -> Iterator[Line]:
    for element in block.iter("div"):
        if element.get("class") == "equation":
            yield Line(element, reader)


def check_assignments(found: list[Line], expected: dict[str, ca.MX], values: Values) -> None:
    """Check that the lines give every element of the expressions, in their order."""
    reader = Reader({v.name for v in values.plant.variables()})
    got: dict[str, dict[int, float]] = {name.replace("[]", ""): {} for name in expected}
    for line in found:
        assert line.left is not None
        left = reader.text(line.left)
        for i in line.elements or [1]:
            scope = {"variable": lambda name, index=1: (name, index), line.letter: i}
            name, index = eval(left, scope)
            got[name][index] = values.of(line, **{line.letter: i})
    for name, expression in expected.items():
        numbers = values.expected(expression)
        mine = got[name.replace("[]", "")]
        assert sorted(mine) == list(range(1, len(numbers) + 1))
        np.testing.assert_allclose(
            [mine[k + 1] for k in range(len(numbers))], numbers, rtol=1e-9, err_msg=name
        )


def check_conditions(found: list[Line], expected: list[bool], values: Values) -> None:
    """Check that the lines give a condition for every element."""
    got = {}
    for line in found:
        for i in line.elements or [1]:
            got[i] = bool(values.of(line, **{line.letter: i}))
    assert [got[k + 1] for k in range(len(expected))] == expected


def parts(page: ET.Element) -> dict[str, list[ET.Element]]:
    """Return what stands under each heading of the equations."""
    found: dict[str, list[ET.Element]] = {}
    heading = ""
    for element in page.findall(".//section[@id='equations']/*"):
        if element.tag == "h3":
            heading = element.text or ""
        found.setdefault(heading, []).append(element)
    return found


def check_page(plant: Plant, seeds: int = 3) -> None:
    """Check that every equation and event on a plant's page is the declared one."""
    found = parts(parsed(documentation_page(plant)))
    reader = Reader({v.name for v in plant.variables()})
    assignments = {
        "Dependent parameters": plant.dependents,
        "States": plant.derivatives,
        "Outputs": plant.outputs,
        "Memories, after each solver step": plant.updates,
    }
    for seed in range(seeds):
        values = Values(plant, seed)
        for heading, expressions in assignments.items():
            blocks = found.get(heading, [])
            read = [line for block in blocks for line in lines(block, reader)]
            check_assignments(read, dict(expressions), values)
        events = [block for block in found.get("Events", []) if block.tag == "dl"]
        for event, block in zip(plant.events, events, strict=True):
            check_event(event, block, reader, values)


def check_event(event: Event, block: ET.Element, reader: Reader, values: Values) -> None:
    read = {
        dt.text: list(lines(dd, reader)) for dt, dd in zip(block[::2], block[1::2], strict=True)
    }
    crossing = values.expected(event.expression)
    if event.kind == "time":
        check_conditions(read["when"], [values.time >= at for at in crossing], values)
    elif event.direction == "both":
        value = values.of(read["when"][0])
        np.testing.assert_allclose(value, crossing[0], rtol=1e-9)
    else:
        sign = 1.0 if event.direction == "rising" else -1.0
        check_conditions(read["when"], [sign * z > 0.0 for z in crossing], values)
    guard = values.expected(event.guard)
    if "while" in read:
        check_conditions(read["while"], [g != 0.0 for g in guard], values)
    else:
        assert all(g == 1.0 for g in guard)
    check_assignments(read["then"], dict(event.changes), values)
