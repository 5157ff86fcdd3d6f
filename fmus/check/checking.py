"""`check`: everything that can be said about an FMU on this machine."""

from pathlib import Path

import numpy as np

from ...base.errors import FileError, FmuError
from ...cosim import Fmu
from ...cosim.fmu_file import read_description, require_co_simulation
from ..simulate import span
from ..tables import Table, read_table
from .behaviour import check_behaviour
from .excitation import Excitation, from_table, grid, seeded
from .reference import OwnEquations, compare, read_reference
from .report import Report
from .structure import check_structure, is_ours

OWN_TOLERANCE = 1e-6  # against the equations: the Runge-Kutta solver's share
FILE_TOLERANCE = 1e-3  # against a file, as in FMI's cross-check


def check(
    path: Path,
    *,
    reference: str | Path | None = None,
    inputs: str | Path | None = None,
    step: float | None = None,
    stop: float | None = None,
    tolerance: float | None = None,
) -> Report:
    """Check an FMI 2.0 co-simulation FMU and return the report.

    `reference` is a CSV file (time, then outputs by name) to compare the run with; `inputs` one
    with the inputs to apply (time, then inputs by name), which may stand in the reference as
    well. Inputs in neither are random without a reference, else at their start values. Without a
    reference, an FMU made by railcosim is compared with its own equations, integrated
    independently. `step` and `stop` (s) default to the FMU's default experiment, `stop` to the
    reference's end. `tolerance` is the allowed error relative to a signal's largest magnitude
    (default 1e-6 against the equations, 1e-3 against a file). Raise FmuError or FileError for
    what cannot be read at all.
    """
    if tolerance is not None and not tolerance > 0.0:
        raise FmuError(f"the tolerance must be positive, not {tolerance:g}")
    description = read_description(path)
    require_co_simulation(path, description)
    tool = description.generationTool or "unknown tool"
    report = Report(f"{path.name}: FMI {description.fmiVersion} co-simulation, made by {tool}")
    check_structure(path, description, report)
    try:
        block = Fmu(path)
    except FmuError as error:
        report.add("loads", [str(error)], "")
        return report
    # A wrong file is refused before anything is run.
    table = None if reference is None else read_reference(reference, block)
    if table is not None and stop is None:
        stop = float(table.times[-1])
        if stop <= 0.0:
            raise FileError(f"{reference} ends at {stop:g} s; nothing can be compared")
    times = grid(span(path, step, stop))
    if inputs is not None:
        applied, name = read_table(inputs, block.inputs, "input"), Path(inputs).name
        excitation = from_table(applied, name, block, description, times)
    elif table is not None:
        excitation = from_table(table, Path(str(reference)).name, block, description, times)
    else:
        excitation = seeded(block, description, times)
    found = check_behaviour(block, description, excitation, report)
    if found is None:
        report.skip("reference", "the FMU does not run")
        return report
    if table is not None:
        reference_of = _of_file(report, block, excitation, table, Path(str(reference)))
    elif is_ours(path):
        reference_of = _of_equations(report, block, description, excitation)
    else:
        report.skip("reference", "none given (--reference), and the FMU carries no equations")
        return report
    if reference_of is not None:
        inside, expected, default = reference_of
        report.comparisons = compare(
            block.outputs,
            excitation.times[inside],
            found[inside],
            expected,
            default if tolerance is None else tolerance,
        )
    return report


# Where the reference holds among the communication points, its signals, the default tolerance.
_Reference = tuple[np.ndarray, dict[str, np.ndarray], float]


def _of_equations(
    report: Report, block: Fmu, description: object, excitation: Excitation
) -> _Reference | None:
    try:
        expected, method = OwnEquations(block, description).run(excitation)
    except FmuError as error:
        report.add("reference", [str(error)], "")
        return None
    report.reference = (
        f"the FMU's own equations by {method}; {excitation.text}; {excitation.span_text}"
    )
    return np.ones(len(excitation.times), dtype=bool), expected, OWN_TOLERANCE


def _of_file(
    report: Report, block: Fmu, excitation: Excitation, table: Table, file: Path
) -> _Reference:
    """Return the file's signals at the communication points that it covers, interpolated."""
    first, last = float(table.times[0]), float(table.times[-1])
    inside = (excitation.times >= first) & (excitation.times <= last)
    if not inside.any():
        raise FileError(f"{file} covers {first:g} to {last:g} s, where there is no output")
    compared = excitation.times[inside]
    report.reference = (
        f"{file.name} at {len(compared)} points from {compared[0]:g} to {compared[-1]:g} s; "
        f"{excitation.text}"
    )
    outputs = [name for name in table.columns if name in block.outputs]
    return inside, table.sample(outputs, compared), FILE_TOLERANCE
