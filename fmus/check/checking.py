"""`check`: everything that can be said about an FMU on this machine."""

from pathlib import Path

import numpy as np

from ...base.errors import FileError, FmuError
from ...cosim import Fmu
from ...cosim.fmu_file import read_description, require_co_simulation
from ..simulate import span
from ..tables import Table, read_table
from .behaviour import check_behaviour, trajectory
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
    reference's end. `tolerance` is the allowed error relative to a
    signal's largest magnitude (default 1e-6 against the equations, 1e-3 against a file). Raise
    FmuError or FileError for what cannot be read at all.
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
    check_behaviour(block, description, excitation, report)
    if any(f.rule in ("runs", "GUID") and f.passed is False for f in report.findings):
        report.skip("reference", "the FMU does not run")
    elif table is not None:
        _against_file(report, block, excitation, table, Path(str(reference)), tolerance)
    elif is_ours(path):
        _against_equations(report, block, description, excitation, tolerance)
    else:
        report.skip("reference", "none given (--reference), and the FMU carries no equations")
    return report


def _against_equations(
    report: Report, block: Fmu, description: object, excitation: Excitation, tolerance: float | None
) -> None:
    try:
        expected, method = OwnEquations(block, description).run(excitation)
    except FmuError as error:
        report.add("reference", [str(error)], "")
        return
    found = trajectory(block, excitation)
    report.reference = (
        f"the FMU's own equations by {method}; {excitation.text}; {excitation.span_text}"
    )
    report.comparisons = compare(
        list(block.outputs),
        {name: unit or "" for name, unit in block.outputs.items()},
        excitation.times,
        found,
        expected,
        OWN_TOLERANCE if tolerance is None else tolerance,
    )


def _against_file(
    report: Report,
    block: Fmu,
    excitation: Excitation,
    table: Table,
    file: Path,
    tolerance: float | None,
) -> None:
    """Compare at the communication points that the file covers; it is interpolated there."""
    first, last = float(table.times[0]), float(table.times[-1])
    inside = (excitation.times >= first) & (excitation.times <= last)
    if not inside.any():
        raise FileError(f"{file} covers {first:g} to {last:g} s, where there is no output")
    found = trajectory(block, excitation)
    outputs = [name for name in table.columns if name in block.outputs]
    expected = table.sample(outputs, excitation.times[inside])
    compared = excitation.times[inside]
    report.reference = (
        f"{file.name} at {len(compared)} points from {compared[0]:g} to {compared[-1]:g} s; "
        f"{excitation.text}"
    )
    report.comparisons = compare(
        list(block.outputs),
        {name: unit or "" for name, unit in block.outputs.items()},
        excitation.times[inside],
        np.asarray(found)[inside],
        expected,
        FILE_TOLERANCE if tolerance is None else tolerance,
    )
