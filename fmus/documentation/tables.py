"""A plant's variables as tables, a vector in one row."""

from collections.abc import Callable, Sequence

from ...models.plant import Plant
from ...models.variable import Kind, Variable
from .html import Column, code, table, text
from .mathml import math
from .naming import identifier, number

_LISTED = 4  # values up to which a vector's are listed; of more the range is shown

_HEADINGS: dict[Kind, tuple[str, str]] = {
    "input": ("Inputs", ""),
    "parameter": ("Parameters", ""),
    "dependent": (
        "Dependent parameters",
        "Computed from the parameters whenever one of them is set; they can only be read.",
    ),
    "state": ("States", ""),
    "mode": ("Modes", "Integers that change at events only."),
    "memory": ("Memories", "Reals that change at events or after inner steps only."),
}


def variable_tables(plant: Plant) -> str:
    """Return the tables of all variables under their headings, HTML."""
    pieces = []
    for kind, (heading, remark) in _HEADINGS.items():
        found = plant.variables(kind)
        if found:
            note = f'<p class="note">{text(remark)}</p>\n' if remark else ""
            pieces.append(f"<h3>{heading}</h3>\n{note}{table(_columns(found, _role(found)))}")
    outputs = [v for v in plant.variables() if v.kind == "output" or v.exposed]
    kinds = ["computed" if v.kind == "output" else v.kind for v in outputs]
    columns = _columns(outputs, Column("kind", kinds, "role"), start=False)
    return "".join(pieces) + f"<h3>Outputs</h3>\n{table(columns)}"


def _role(found: Sequence[Variable]) -> Column:
    """Return what a kind leaves open: when parameters may change, what is an output too."""
    if found[0].kind in ("parameter", "dependent"):
        return Column("variability", [v.variability for v in found], "role")
    cells = ["output" if v.exposed else "" for v in found]
    return Column("also" if any(cells) else "", cells, "role")


def _columns(found: Sequence[Variable], role: Column, *, start: bool = True) -> list[Column]:
    def numbers(of: Callable[[Variable], Sequence[float] | None]) -> list[str]:
        return [values(of(v)) for v in found]

    return [
        Column("name", [_name(v) for v in found], "name"),
        Column("unit", [code(v.unit) for v in found], "unit"),
        Column("start", numbers(lambda v: v.start if start else None), "number"),
        Column("min", numbers(lambda v: v.minimum), "number"),
        Column("max", numbers(lambda v: v.maximum), "number"),
        Column("nominal", numbers(lambda v: v.nominal), "number"),
        role,
        Column("description", [text(v.description) for v in found]),
    ]


def _name(variable: Variable) -> str:
    """Return the name as tools show it, and its symbol where equations show another."""
    names = variable.element_names
    name = code(names[0])
    if len(names) > 1:
        name += f"{',' if len(names) == 2 else ' …'} {code(names[-1])}"
    symbol = identifier(variable.name)
    if "." not in variable.name and symbol != f"<mi>{variable.name}</mi>":
        name += f'<span class="note">{math(symbol)}</span>'
    return name


def values(numbers: Sequence[float] | None) -> str:
    """Return the values of a variable's elements: one for all, a list, or their range."""
    if numbers is None:
        return ""
    if len(set(numbers)) == 1:
        return number(numbers[0])
    if len(numbers) <= _LISTED:
        return ", ".join(number(n) for n in numbers)
    return f"{number(min(numbers))} … {number(max(numbers))}"
