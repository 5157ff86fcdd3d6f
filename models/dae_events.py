"""A `casadi.DaeBuilder`'s when-equations, read out of it and declared as a plant's events."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from ..base.errors import DeclarationError
from .dae_equations import terms, total, where
from .event import DISCRETE
from .plant import Plant

_CHANGE = re.compile(r"    (.+?) := (.*)")
_HEADING = "When equations:\n"


@dataclass(frozen=True)
class When:
    """A when-equation: the changes, by variable name, that are made as `crossing` turns negative.

    `number` counts from 1 in the order in which they were added; `text` is for messages.
    """

    number: int
    text: str
    crossing: ca.MX
    changes: Mapping[str, ca.MX]


def when_equations(dae: ca.DaeBuilder) -> list[When]:
    """Return the when-equations.

    CasADi keeps to itself which assignments belong to which of them, but lists them as text:
    each line is matched with the helper variables that hold the expressions.
    Raise DeclarationError for what the listing leaves open, or for a variable assigned twice.
    """
    crossings = dae.outputs("zero")
    blocks = _listed(dae.str(True)) if crossings else []
    if len(blocks) != len(crossings):
        raise DeclarationError(
            f"{where(dae)}: cannot read CasADi {ca.CasadiMeta.version()}'s listing of "
            f"when-equations: {len(blocks)} found, {len(crossings)} expected"
        )
    whens = []
    for i, (crossing, lines) in enumerate(zip(crossings, blocks, strict=True)):
        changes: dict[str, ca.MX] = {}
        for name, text in lines:
            if name in changes:
                raise DeclarationError(
                    f"{where(dae)}: when-equation {i + 1} assigns '{name}' twice; keep one"
                )
            changes[name] = _assigned(dae, i, name, text)
        text = f"when {crossing} < 0".replace("\n", " ")
        whens.append(When(i + 1, text, crossing, changes))
    return whens


def _listed(text: str) -> list[list[tuple[str, str]]]:
    """Return, for each when-equation in a listing, the lines (variable, text of expression)."""
    blocks: list[list[tuple[str, str]]] = []
    for line in text.partition(_HEADING)[2].split("\n"):
        change = _CHANGE.fullmatch(line)
        if line.startswith("  when "):
            blocks.append([])
        elif change and blocks:
            blocks[-1].append((change[1], change[2]))
        elif blocks and blocks[-1]:  # a matrix takes several lines
            name, begun = blocks[-1][-1]
            blocks[-1][-1] = (name, f"{begun}\n{line}")
    return blocks


def _assigned(dae: ca.DaeBuilder, index: int, name: str, text: str) -> ca.MX:
    """Return the expression that a when-equation assigns to a variable."""
    helper = re.compile(rf"__(assign|reinit)__{re.escape(name)}__\d*")
    helpers = [
        h for h in dae.all() if helper.fullmatch(h) and str(dae.var(h)).strip() == text.strip()
    ]
    if helpers and all(ca.is_equal(dae.var(helpers[0]), dae.var(h), 99) for h in helpers):
        return dae.var(helpers[0])
    if len(helpers) > 1:  # alike but for digits that are not printed
        helpers = _between(dae, index, helpers)
    if len(helpers) != 1:
        raise DeclarationError(
            f"{where(dae)}: when-equation {index + 1}: cannot tell which of several assignments "
            f"to '{name}' it makes; create each inside its own dae.when(…)"
        )
    return dae.var(helpers[0])


def _between(dae: ca.DaeBuilder, index: int, helpers: list[str]) -> list[str]:
    """Return the helpers that were created for this when-equation, after the one before it."""
    names = list(dae.all())
    marks = [i for i, name in enumerate(names) if re.fullmatch(r"__when__\d*", name)]
    if len(marks) != len(dae.outputs("zero")):
        return []
    before = marks[index - 1] if index else 0
    return [h for h in helpers if before < names.index(h) < marks[index]]


def declare_event(
    dae: ca.DaeBuilder, plant: Plant, when: When, changes: dict[ca.MX, ca.MX]
) -> None:
    """Declare a when-equation, given in the plant's symbols, as an event.

    Where only the time moves in the condition it is a time event, which the solver steps onto.
    """
    if not when.crossing.is_scalar():
        raise DeclarationError(
            f"{where(dae)}: when-equation {when.number} ({when.text}) has a vector condition; "
            "write one for each element"
        )
    name, text = f"when_{when.number}", when.text
    at = _time(plant, when.crossing)
    if at is None:
        plant.event(name, when.crossing, direction="falling", changes=changes, description=text)
    else:
        plant.time_event(name, at, changes=changes, description=text)


def _time(plant: Plant, crossing: ca.MX) -> ca.MX | None:
    """Return T if a crossing is T - time with a T that changes at events only, or None."""
    now = plant.time.__hash__()
    parts = terms(crossing)
    rest = [(sign, term) for sign, term in parts if term.__hash__() != now]
    settled = {v.symbol.__hash__() for v in plant.variables(*DISCRETE)}
    moving = any(s.__hash__() not in settled for _, term in rest for s in ca.symvar(term))
    times = [sign for sign, term in parts if term.__hash__() == now]
    return None if times != [-1] or moving else total(rest)


def check_start(dae: ca.DaeBuilder, plant: Plant) -> None:
    """Raise DeclarationError for a condition that holds at the start.

    A plant's event fires on it, CasADi's when-equation waits until it comes true anew.
    """
    symbols = [plant.time, *(v.symbol for v in plant.variables() if v.start is not None)]
    values = [[0.0], *(v.start for v in plant.variables() if v.start is not None)]
    known = [v.symbol for v in plant.variables("dependent")]
    for event in plant.events:
        crossing = ca.substitute(
            [event.expression], known, [plant.dependents[s.name()] for s in known]
        )[0]
        value = float(ca.Function("start", symbols, [crossing]).call([ca.DM(v) for v in values])[0])
        if value < 0.0:
            raise DeclarationError(
                f"{where(dae)}: the condition of when-equation {event.name.removeprefix('when_')} "
                f"({event.description}) holds at the start already; CasADi would not execute it "
                "there, a plant would: choose start values on its other side"
            )
