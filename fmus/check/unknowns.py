"""Checks of <ModelStructure>: outputs, derivatives, initial unknowns and their dependencies."""

from collections import Counter
from typing import Any
from xml.etree.ElementTree import Element

from .report import Report

PARTS = ("Outputs", "Derivatives", "InitialUnknowns")


def check_unknowns(description: Any, report: Report) -> None:
    """Add the findings on the model structure."""
    problems = _doubled(description) + _missing(description)
    report.add("model structure", problems, "outputs, derivatives and initial unknowns complete")
    odd = _odd_dependencies(description)
    if odd:
        report.warn("dependencies", odd, "")


def index_problems(root: Element) -> list[str]:
    """Return what is wrong with the indices of variables in an XML description."""
    count = len(root.findall("ModelVariables/ScalarVariable"))
    problems = []
    for part in PARTS:
        for unknown in root.findall(f"ModelStructure/{part}/Unknown"):
            index = unknown.get("index", "")
            named = {"index": [index], "dependencies": unknown.get("dependencies", "").split()}
            problems += [
                f"in {part}, {what} of Unknown {index} name variable {text}; there are 1 to {count}"
                for what, texts in named.items()
                for text in texts
                if not _is_index(text, count)
            ]
    for number, variable in enumerate(root.findall("ModelVariables/ScalarVariable"), start=1):
        real = variable.find("Real")
        text = None if real is None else real.get("derivative")
        if text is not None and not _is_index(text, count):
            name = variable.get("name", f"variable {number}")
            problems.append(f"{name} is the derivative of variable {text}; there are 1 to {count}")
    return problems


def _is_index(text: str, count: int) -> bool:
    return text.isascii() and text.isdigit() and 1 <= int(text) <= count


def _parts(description: Any) -> dict[str, list[Any]]:
    lists = (description.outputs, description.derivatives, description.initialUnknowns)
    return dict(zip(PARTS, lists, strict=True))


def _doubled(description: Any) -> list[str]:
    return [
        f"{name} stands {n} times in {part}"
        for part, unknowns in _parts(description).items()
        for name, n in Counter(u.variable.name for u in unknowns).items()
        if n > 1
    ]


def _missing(description: Any) -> list[str]:
    """FMI 2.0.1, 2.2.8: all outputs, all derivatives of states, and all that is to be computed."""
    problems = []
    derivatives = [u.variable for u in description.derivatives]
    for v in derivatives:
        if v.derivative is None:
            problems.append(f"{v.name} in Derivatives does not say what it is the derivative of")
    outputs = {v.name for v in description.modelVariables if v.causality == "output"}
    around = [*derivatives, *(v.derivative for v in derivatives if v.derivative is not None)]
    initial = {v.name for v in around if v.initial in ("approx", "calculated")}
    for v in description.modelVariables:
        if v.causality == "calculatedParameter" or (
            v.causality == "output" and v.initial in ("approx", "calculated")
        ):
            initial.add(v.name)
    for part, expected in (("Outputs", outputs), ("InitialUnknowns", initial)):
        found = {u.variable.name for u in _parts(description)[part]}
        problems += [f"{name} is missing in {part}" for name in sorted(expected - found)]
        problems += [f"{name} does not belong in {part}" for name in sorted(found - expected)]
    return problems


def _odd_dependencies(description: Any) -> list[str]:
    """During a run only inputs, continuous states and time are known."""
    states = {u.variable.derivative.name for u in description.derivatives if u.variable.derivative}
    problems = []
    for part in ("Outputs", "Derivatives"):
        for unknown in _parts(description)[part]:
            for v in unknown.dependencies or []:
                if v.causality not in ("input", "independent") and v.name not in states:
                    text = f"{unknown.variable.name} lists {v.name}, which is no input or state"
                    problems.append(text)
    return problems
