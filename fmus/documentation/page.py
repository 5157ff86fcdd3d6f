"""documentation/index.html of a plant's FMU: one file that opens anywhere, without a network."""

import inspect
from dataclasses import fields

from ...base.errors import listing
from ...models.plant import Plant
from ...models.solver import Solver
from ...models.variable import Kind
from .equations import Equations
from .html import Column, code, prose, section, table, text
from .naming import number
from .style import STYLE
from .tables import variable_tables

_STARTED: dict[Kind, str] = {"state": "states", "mode": "modes", "memory": "memories"}
_SETTINGS = {
    "inner_step": ("s", "largest inner step"),
    "relative_tolerance": ("1", "error allowed in a step, relative to the value"),
    "absolute_tolerance": ("1", "error allowed in a step, relative to the nominal value"),
}


def documentation_page(
    plant: Plant, *, tool: str = "railcosim", guid: str = "", solver: Solver | None = None
) -> str:
    """Return the page as HTML that is well-formed XML too; the same plant gives the same text.

    `tool` says what made the FMU, `guid` (if given) which one the page belongs to; `solver` is
    the one inside, by default the plant's. Raise DeclarationError if the plant is not finished.
    """
    solver = plant.solver if solver is None else solver
    sections = (
        ("use", "How to use it", _use(plant)),
        ("variables", "Variables", variable_tables(plant)),
        ("equations", "Equations", Equations(plant).html()),
        ("solver", "Solver", _solver(solver)),
    )
    links = "".join(f'<a href="#{identity}">{heading}</a>' for identity, heading, _ in sections)
    body = "".join(section(*parts) for parts in sections)
    made = f"Written by {text(tool)} from the plant's declaration."
    footer = f"{made} GUID {code(guid)}" if guid else made
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>\n'
        f'<meta name="generator" content="{text(tool)}"/>\n'
        f"<title>{text(plant.name)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f"<header>\n<h1>{text(plant.name)}</h1>\n{_lead(plant)}<nav>{links}</nav>\n</header>\n"
        f"<main>\n{body}</main>\n<footer>{footer}</footer>\n</body>\n</html>\n"
    )


def _lead(plant: Plant) -> str:
    return f'<p class="lead">{text(plant.description)}</p>\n' if plant.description else ""


def _use(plant: Plant) -> str:
    """Return how a tool runs the FMU, as far as it depends on the plant."""
    items = [
        '<b>Co-Simulation</b>: the FMU brings its own <a href="#solver">solver</a>; the tool sets '
        "the inputs and asks for steps. <b>Model Exchange</b>: the tool's solver integrates the "
        "equations below. Both are FMI 2.0.",
        f"Default experiment: from 0 to {number(plant.stop)} s in steps of {number(plant.step)} s, "
        "which tools take when they are told nothing else.",
    ]
    if plant.variables("input"):
        items.append(
            "Inputs may be set before and during the run; otherwise they keep their start values."
        )
    found = {v.variability for v in plant.variables("parameter")}
    if "fixed" in found:
        items.append("Fixed parameters may be set before the run.")
    if "tunable" in found:
        items.append("Tunable parameters may be set before the run and between its steps.")
    started = [names for kind, names in _STARTED.items() if plant.variables(kind)]
    if started:
        items.append(f"Start values of {listing(started)} may be set before the run.")
    if any(v.size is not None for v in plant.variables()):
        items.append("Every element of a vector is a variable of its own, counted from 1.")
    items.append(
        "Units are written as FMI and Modelica do: <code>m/s2</code> is m/s², <code>N.m</code> is "
        "N·m, <code>1</code> is dimensionless. Time is in s."
    )
    return "<ul>\n" + "".join(f"<li>{item}</li>\n" for item in items) + "</ul>\n"


def _solver(solver: Solver) -> str:
    """Return what the solver is, and its settings as the FMU's parameters."""
    doc = inspect.getdoc(type(solver)) or ""
    names = list(solver.settings)
    columns = (
        Column("name", [code(f"solver.{name}") for name in names], "name"),
        Column("unit", [code(_SETTINGS.get(n, ("1", ""))[0]) for n in names], "unit"),
        Column("start", [number(solver.settings[name]) for name in names], "number"),
        Column("description", [_SETTINGS.get(n, ("1", ""))[1] for n in names]),
    )
    return (
        f"<p>In co-simulation: {code(type(solver).__name__)}</p>\n{prose(doc)}{_choices(solver)}"
        f"<p>Its settings are parameters that may be set before the run:</p>\n{table(columns)}"
    )


def _choices(solver: Solver) -> str:
    """Return what was chosen besides numbers, which is fixed in the FMU."""
    chosen = [f.name for f in fields(solver) if f.name not in solver.settings]
    pieces = []
    for name in chosen:
        value = getattr(solver, name)
        listed = value if isinstance(value, tuple | list) else (value,)
        pieces.append(f"<p>{code(name)}: {', '.join(code(str(v)) for v in listed)}</p>\n")
    return "".join(pieces)
