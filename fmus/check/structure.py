"""Checks of the archive and of modelDescription.xml."""

import json
import zipfile
import zlib
from pathlib import Path, PurePosixPath
from typing import Any
from xml.etree import ElementTree

from ...base.errors import FmuError
from ...cosim.fmu.file import number_of
from ..building import DESCRIPTION, VARIABLES, guid_of, is_hashed
from ..code import GUID_MARK
from .report import Report
from .subject import is_ours
from .unknowns import check_unknowns, index_problems
from .variables import check_variables

# What Python raises on a damaged archive, depending on where the damage is.
DAMAGE = (
    zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, NotImplementedError, RuntimeError
)  # fmt: skip


def check_structure(path: Path, description: Any, report: Report) -> None:
    """Add the findings that need no run."""
    report.add("archive", _archive(path), "every file is whole, with a path inside the FMU")
    report.add("FMPy's validation", _fmpy(path), "no problem")
    check_variables(description, report)
    check_unknowns(description, report)
    if description.defaultExperiment is not None:
        report.add("default experiment", _experiment(description), "times that make sense")
    if is_ours(path):
        report.add("contents", _contents(path, description), "GUID is the hash of the contents")


def is_broken(path: Path, report: Report) -> bool:
    """Report a model structure whose indices lead nowhere: nothing can read such an FMU."""
    try:
        with zipfile.ZipFile(path) as archive:
            root = ElementTree.fromstring(archive.read(DESCRIPTION))
    except (*DAMAGE, KeyError, ElementTree.ParseError):
        return False  # reading it says what is wrong
    problems = index_problems(root) if root.get("fmiVersion") == "2.0" else []
    if problems:
        report.add("archive", _archive(path), "every file is whole, with a path inside the FMU")
        report.add("FMPy's validation", _fmpy(path), "no problem")
        report.add("model structure", problems, "")
        report.skip("the rest", "a description with such indices cannot be read")
    return bool(problems)


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


def _experiment(description: Any) -> list[str]:
    experiment = description.defaultExperiment
    try:
        start, stop, step, tolerance = (
            number_of(experiment, name)
            for name in ("startTime", "stopTime", "stepSize", "tolerance")
        )
    except FmuError as error:
        return [str(error)]
    problems = []
    if stop is not None and not stop > (start or 0.0):
        problems.append(f"it stops at {stop:g} s, and starts at {start or 0.0:g} s")
    for what, value in (("step size", step), ("tolerance", tolerance)):
        if value is not None and not value > 0.0:
            problems.append(f"its {what} {value:g} is not positive")
    return problems


def _contents(path: Path, description: Any) -> list[str]:
    try:
        with zipfile.ZipFile(path) as archive:
            contents = {name: archive.read(name) for name in archive.namelist() if is_hashed(name)}
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
