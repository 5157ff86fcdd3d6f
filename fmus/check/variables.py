"""Checks of the variables that a description declares: names, starts, units, references."""

from collections import Counter, defaultdict
from typing import Any

from ...base.errors import FmuError
from ...cosim.fmu.file import number_of, start_of, unit_of
from .report import Report


def check_variables(description: Any, report: Report) -> None:
    """Add the findings on the variables."""
    report.add("names", _names(description), "each variable has a name of its own")
    report.add("start values", _starts(description), "where they must be, and within min and max")
    report.add("value references", _references(description), "shared only by consistent aliases")
    report.add("units", _units(description), "every unit used is defined")


def _names(description: Any) -> list[str]:
    counts = Counter(v.name for v in description.modelVariables)
    problems = [f"{n} variables are named '{name}'" for name, n in counts.items() if n > 1]
    for name in counts:
        if not name or any(ord(character) < 32 for character in name):
            problems.append(f"{name!r} is no name")
    return problems


def _starts(description: Any) -> list[str]:
    problems = []
    for v in description.modelVariables:
        needs = v.causality in ("input", "parameter") or v.initial in ("exact", "approx")
        if v.start is None:
            if needs or v.variability == "constant":
                problems.append(f"{v.name} ({v.causality}) needs a start value")
            continue
        if v.initial == "calculated" or v.causality == "independent":
            problems.append(f"{v.name} is calculated, and has a start value all the same")
        try:
            value = start_of(v)
            low, high = number_of(v, "min"), number_of(v, "max")
        except FmuError as error:
            problems.append(str(error))
            continue
        if low is not None and high is not None and low > high:
            problems.append(f"{v.name} has a min of {low:g} and a max of {high:g}")
        elif v.type in ("Real", "Integer", "Enumeration") and not (
            (low is None or value >= low) and (high is None or value <= high)
        ):
            problems.append(f"{v.name} starts at {value:g}, outside its min and max")
    return problems


def _references(description: Any) -> list[str]:
    """Variables that share type and value reference are one value: all about it must agree."""
    groups: dict[tuple[str, int], list[Any]] = defaultdict(list)
    for variable in description.modelVariables:
        kind = "Integer" if variable.type == "Enumeration" else variable.type
        groups[kind, variable.valueReference].append(variable)
    problems = []
    for (_, reference), members in groups.items():
        names = " and ".join(v.name for v in members)
        shared = f"{names} share value reference {reference}"
        try:
            starts = {start_of(v) for v in members if v.start is not None}
        except FmuError as error:
            problems.append(str(error))
            continue
        if len(starts) > 1:
            problems.append(f"{shared} but start differently")
        settable = [v for v in members if v.causality in ("input", "parameter")]
        if len(settable) > 1:
            problems.append(f"{shared}, and more than one is set")
        if len({unit_of(v) for v in members}) > 1:
            problems.append(f"{shared} but not the unit")
        if len({v.variability for v in members}) > 1:
            problems.append(f"{shared} but not the variability")
    return problems


def _units(description: Any) -> list[str]:
    defined = {unit.name for unit in description.unitDefinitions}
    problems = []
    for variable in description.modelVariables:
        unit = unit_of(variable)
        if unit is not None and unit not in defined:
            problems.append(f"unit '{unit}' of {variable.name} is not defined")
    return problems
