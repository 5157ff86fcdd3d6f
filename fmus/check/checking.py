"""`check`: everything that can be said about an FMU on this machine."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.errors import FileError, FmuError
from ...cosim.fmu.file import read_description
from ..simulate import span
from ..tables import Table, read_table
from .behaviour import check_instances, check_run, check_steps
from .binaries import check_binary
from .child import TIMEOUT, require_timeout
from .equations import OwnEquations
from .excitation import Excitation, from_table, grid, seeded
from .heartbeat import Heartbeat
from .initialization import check_initialization
from .instance import CO_SIMULATION, MODEL_EXCHANGE
from .models import check_exchange
from .own import OwnValues, check_equations
from .reference import compare, read_reference
from .report import Report
from .slopes import check_slopes
from .states import check_state
from .structure import check_structure, is_broken
from .subject import Subject

OWN_TOLERANCE = 1e-6  # against the equations: the Runge-Kutta solver's share
FILE_TOLERANCE = 1e-3  # against a file, as in FMI's cross-check
THE_FILE = "the file"  # the first part of the report; the others are the interfaces


def check(
    path: Path,
    *,
    reference: str | Path | None = None,
    inputs: str | Path | None = None,
    step: float | None = None,
    stop: float | None = None,
    tolerance: float | None = None,
    timeout: float = TIMEOUT,
    findings: Path | None = None,
    heartbeat: Heartbeat | None = None,
) -> Report:
    """Check an FMI 2.0 FMU, for co-simulation, model exchange or both, and return the report.

    `reference` is a CSV file (time, then outputs by name) to compare the run with; `inputs` one
    with the inputs to apply (time, then inputs by name), which may stand in the reference as
    well. Inputs in neither are random without a reference, else at their start values. Without a
    reference, an FMU made by railcosim is compared with its own equations, integrated
    independently. `step` and `stop` (s) default to the FMU's default experiment, `stop` to the
    reference's end. `tolerance` is the allowed error relative to a signal's largest magnitude
    (default 1e-6 against the equations, 1e-3 against a file), and decides also where two
    solutions of the FMU's own are compared. Raise FmuError or FileError for what cannot be read at
    all.

    An FMU that crashes or hangs takes this process with it, but for the calls in the second process
    that goes on from serialized states: these may take `timeout` (s; infinity waits for ever). See
    `check_isolated`, for which each finding is written at once to the file `findings`, and the
    calls that run to `heartbeat`.
    """
    require_timeout(timeout)
    if tolerance is not None and not tolerance > 0.0:
        raise FmuError(f"the tolerance must be positive, not {tolerance:g}")
    report = Report(path.name, part=THE_FILE, file=findings)
    if path.exists() and is_broken(path, report):
        return report
    subject = Subject(path, read_description(path), timeout, heartbeat)
    report.name = _title(subject)
    check_structure(path, subject.description, report)
    try:
        subject.require_binaries()
    except FmuError as error:
        report.add("binary", [str(error)], "")
        return report
    try:
        task = _task(subject, reference, inputs, step, stop, tolerance)
    except FmuError as error:
        if report.passed:
            raise
        report.skip("the rest", str(error))  # the description is at fault, as told above
        return report
    _run(subject, task, report)
    return report


def _title(subject: Subject) -> str:
    kinds = " and ".join(subject.interfaces) or "no interface"
    tool = subject.description.generationTool or "unknown tool"
    return f"{subject.path.name}: FMI 2.0, {kinds}, made by {tool}"


@dataclass(frozen=True)
class _Task:
    """What the FMU is run with and compared to."""

    excitation: Excitation
    table: Table | None
    file: Path | None
    tolerance: float | None


def _task(
    subject: Subject,
    reference: str | Path | None,
    inputs: str | Path | None,
    step: float | None,
    stop: float | None,
    tolerance: float | None,
) -> _Task:
    """Read the files: a wrong one is refused before anything is run."""
    table = None if reference is None else read_reference(reference, subject)
    file = None if reference is None else Path(reference)
    if table is not None and stop is None:
        stop = float(table.times[-1])
        if stop <= 0.0:
            raise FileError(f"{reference} ends at {stop:g} s; nothing can be compared")
    times = grid(span(subject.path, step, stop))
    if inputs is not None:
        applied = read_table(inputs, subject.inputs, "input")
        excitation = from_table(applied, Path(inputs).name, subject, times)
    elif table is not None and file is not None:
        excitation = from_table(table, file.name, subject, times)
    else:
        excitation = seeded(subject, times)
    return _Task(excitation, table, file, tolerance)


def _run(subject: Subject, task: _Task, report: Report) -> None:
    """Run both interfaces, and compare with the reference."""
    equations = None
    if subject.is_ours:
        try:
            equations = OwnEquations(subject)
        except FmuError as error:
            report.add("equations", [str(error)], "")
    base = found = None
    if CO_SIMULATION in subject.interfaces:
        report.part = CO_SIMULATION
        if check_binary(subject, CO_SIMULATION, report):
            base = _co_simulation(subject, task, equations, report)
    if MODEL_EXCHANGE in subject.interfaces:
        report.part = MODEL_EXCHANGE
        if check_binary(subject, MODEL_EXCHANGE, report):
            own = None if equations is None else OwnValues(subject, equations)
            check_initialization(subject, MODEL_EXCHANGE, task.excitation, report)
            found = check_exchange(subject, task.excitation, base, own, task.tolerance, report)
    report.part = "reference"
    _reference(subject, task, equations, found if base is None else base, report)


def _co_simulation(
    subject: Subject, task: _Task, equations: OwnEquations | None, report: Report
) -> np.ndarray | None:
    excitation, tolerance = task.excitation, task.tolerance
    check_initialization(subject, CO_SIMULATION, excitation, report)
    base = check_run(subject, excitation, report)
    if base is None:
        return None
    check_instances(subject, excitation, base, report)
    check_steps(subject, excitation, base, tolerance, report)
    check_slopes(subject, excitation, equations, report)
    check_state(subject, excitation, base, report)
    if equations is not None:
        check_equations(subject, equations, excitation, report)
    return base


# The reference


def _reference(
    subject: Subject,
    task: _Task,
    equations: OwnEquations | None,
    found: np.ndarray | None,
    report: Report,
) -> None:
    if found is None:
        report.skip("reference", "the FMU does not run")
    elif task.table is not None and task.file is not None:
        _against_file(subject, task, task.table, task.file, found, report)
    elif equations is None:
        report.skip("reference", "none given (--reference), and the FMU carries no equations")
    elif subject.is_hybrid:
        exchange = MODEL_EXCHANGE in subject.interfaces
        rules = (
            "'equations' and 'against co-simulation' stand" if exchange else "'equations' stands"
        )
        what = "events and updates do" if exchange else "events, updates and dry friction do"
        report.nothing("reference", f"the equations do not tell what {what}; {rules} for it")
    else:
        _against_equations(subject, task, equations, found, report)


def _against_equations(
    subject: Subject, task: _Task, equations: OwnEquations, found: np.ndarray, report: Report
) -> None:
    excitation = task.excitation
    try:
        expected, method = equations.run(excitation)
    except FmuError as error:
        report.add("reference", [str(error)], "")
        return
    report.reference = (
        f"the FMU's own equations by {method}; {excitation.text}; {excitation.span_text}"
    )
    tolerance = task.tolerance or OWN_TOLERANCE
    report.comparisons = compare(subject.outputs, excitation.times, found, expected, tolerance)


def _against_file(
    subject: Subject, task: _Task, table: Table, file: Path, found: np.ndarray, report: Report
) -> None:
    """Compare with the file's signals at the communication points that it covers, interpolated."""
    first, last = float(table.times[0]), float(table.times[-1])
    times = task.excitation.times
    inside = (times >= first) & (times <= last)
    if not inside.any():
        raise FileError(f"{file} covers {first:g} to {last:g} s, where there is no output")
    compared = times[inside]
    report.reference = (
        f"{file.name} at {len(compared)} points from {compared[0]:g} to {compared[-1]:g} s; "
        f"{task.excitation.text}"
    )
    outputs = [name for name in table.columns if name in subject.outputs]
    expected = table.sample(outputs, compared)
    tolerance = task.tolerance or FILE_TOLERANCE
    report.comparisons = compare(subject.outputs, compared, found[inside], expected, tolerance)
