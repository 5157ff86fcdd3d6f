"""Checks of the archive and of modelDescription.xml."""

import json
import zipfile
import zlib
from collections import defaultdict
from pathlib import Path, PurePosixPath
from typing import Any

from ...base.errors import FmuError
from ...cosim.fmu_file import start_of, unit_of
from ..building import DESCRIPTION, EQUATIONS, VARIABLES, guid_of
from ..code import GUID_MARK
from .report import Report

# What Python raises on a damaged archive, depending on where the damage is.
DAMAGE = (
    zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, NotImplementedError, RuntimeError
)  # fmt: skip


def check_structure(path: Path, description: Any, report: Report) -> None:
    """Add the findings that need no run."""
    report.add("archive", _archive(path), "every file is whole, with a path inside the FMU")
    report.add("FMPy's validation", _fmpy(path), "no problem")
    report.add("value references", _references(description), "shared only by consistent aliases")
    report.add("units", _units(description), "every unit used is defined")
    if is_ours(path):
        report.add("contents", _contents(path, description), "GUID is the hash of the contents")


def is_ours(path: Path) -> bool:
    """Return whether the FMU carries its equations as railcosim writes them."""
    with zipfile.ZipFile(path) as archive:
        return {EQUATIONS, VARIABLES} <= set(archive.namelist())


def _archive(path: Path) -> list[str]:
    problems = []
    with zipfile.ZipFile(path) as archive:
        try:
            damaged = archive.testzip()
        except DAMAGE as error:
            return [f"damaged: {error}"]
        if damaged:
            problems.append(f"{damaged} is damaged (wrong checksum)")
        names = archive.namelist()
    for name in names:
        parts = PurePosixPath(name).parts
        if name.startswith("/") or ".." in parts or "\\" in name or ":" in name:
            problems.append(f"'{name}' leads out of the FMU")
    problems += [f"'{name}' stands twice in the archive" for name in _doubled(names)]
    return problems


def _fmpy(path: Path) -> list[str]:
    from fmpy.validation import validate_fmu

    return [" ".join(problem.split()) for problem in validate_fmu(str(path))]


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


def _contents(path: Path, description: Any) -> list[str]:
    try:
        with zipfile.ZipFile(path) as archive:
            contents = {
                name: archive.read(name)
                for name in archive.namelist()
                if name == DESCRIPTION
                or (name.startswith(("sources/", "resources/")) and not name.endswith("/"))
            }
    except DAMAGE as error:
        return [f"damaged: {error}"]
    guid = str(description.guid).encode()
    blank = {name: data.replace(guid, GUID_MARK.encode()) for name, data in contents.items()}
    problems = []
    if guid_of(blank) != description.guid:
        problems.append("the GUID is not the hash of description, sources and equations")
    try:
        listed = json.loads(contents[VARIABLES])
        known = {v.name for v in description.modelVariables}
        missing = [n for names in listed.values() for n in names if n not in known]
    except (ValueError, AttributeError, TypeError):
        return [*problems, f"{VARIABLES} cannot be read"]
    if missing:
        problems.append(f"{VARIABLES} names {missing[0]}, which is no variable")
    return problems


def _doubled(names: list[str]) -> list[str]:
    seen: set[str] = set()
    return [name for name in names if name in seen or seen.add(name)]
