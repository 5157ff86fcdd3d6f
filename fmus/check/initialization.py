"""Checks of what stands before a run: log categories, start values, initial unknowns."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from ...base.errors import FmuError
from ...cosim.fmu.file import start_of
from .derivatives import Dependencies, Slopes
from .excitation import SEED, Excitation
from .instance import Instance
from .places import Initial, nearby
from .report import Nothing, Report, Result
from .subject import Subject

PLACES = 3  # the start values, and random ones near them


def check_initialization(
    subject: Subject, interface: str, excitation: Excitation, report: Report
) -> None:
    """Add the findings on one interface's log categories, start values and initial unknowns."""
    time = float(excitation.times[0])
    if subject.description.logCategories:
        report.judge("log categories", lambda: _logging(subject, interface))
    report.judge("initial values", lambda: _starts(subject, interface, time))
    if not subject.description.initialUnknowns:
        return
    report.judge("initial dependencies", lambda: _dependencies(subject, interface, time))
    if subject.declares(interface, "providesDirectionalDerivative"):
        report.judge("initial derivatives", lambda: _slopes(subject, interface, time))


@contextmanager
def _opened(subject: Subject, interface: str) -> Iterator[Instance]:
    instance = subject.instance(interface)
    try:
        yield instance
    finally:
        instance.close()


def _logging(subject: Subject, interface: str) -> Result:
    names = [c.name for c in subject.description.logCategories]
    problems = []
    with _opened(subject, interface) as instance:
        for on in (True, False):
            for chosen in (*([n] for n in names), names):
                try:
                    instance.call("setDebugLogging", on, chosen)
                except FmuError as error:
                    problems.append(f"{', '.join(chosen)} is not taken: {error}")
    return problems, f"each of the {len(names)} is taken"


def _starts(subject: Subject, interface: str, time: float) -> Result:
    problems, count = [], 0
    with _opened(subject, interface) as instance:
        instance.enter_initialization(time, None)
        for variable in subject.description.modelVariables:
            wanted = start_of(variable)
            if variable.initial != "exact" or wanted is None:
                continue
            kind = "Integer" if variable.type == "Enumeration" else variable.type
            value = instance.call(f"get{kind}", [variable.valueReference])[0]
            if isinstance(value, bytes):
                value = value.decode(errors="replace")
            count += 1
            if value != wanted:
                problems.append(f"{variable.name} starts at {value}, by the description {wanted}")
    if not count:
        raise Nothing("no variable has an exact start value")
    return problems, f"{count} exact ones are what the FMU starts with"


def _places(subject: Subject, interface: str, time: float) -> Iterator[Initial]:
    generator = np.random.default_rng(SEED + 4)
    with _opened(subject, interface) as instance:
        place = Initial(subject, instance, time)
        for number in range(PLACES):
            if number:
                place.move(nearby(place, generator))
            yield place


def _dependencies(subject: Subject, interface: str, time: float) -> Result:
    found, generator = Dependencies(), np.random.default_rng(SEED + 5)
    for place in _places(subject, interface, time):
        found.visit(place, generator)
    return found.result()


def _slopes(subject: Subject, interface: str, time: float) -> Result:
    found, generator = Slopes(), np.random.default_rng(SEED + 6)
    for place in _places(subject, interface, time):
        found.visit(place, generator)
    return found.result()
