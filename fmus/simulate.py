"""One FMU, run alone with inputs from a file."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..base.errors import FmuError
from ..cosim import Constant, Diagram, Fmu, Profile, Run, SimulationError
from ..cosim.fmu_file import read_description
from .tables import read_table


def default_experiment(path: Path, step: float | None, stop: float | None) -> tuple[float, float]:
    """Return (step, stop) in s: as given, else the FMU's default experiment, else 10 s / 500.

    Raise FmuError for times that are not positive.
    """
    experiment = read_description(path).defaultExperiment
    declared = None if experiment is None else experiment.stopTime
    stop = float(declared or 10.0) if stop is None else stop
    declared = None if experiment is None else experiment.stepSize
    step = float(declared or stop / 500.0) if step is None else step
    for value, what in ((step, "step"), (stop, "stop")):
        if not 0.0 < value < float("inf"):
            raise FmuError(f"{what} must be a positive time in s, not {value:g}")
    return step, stop


def simulate(
    path: Path,
    *,
    inputs: str | Path | None = None,
    step: float | None = None,
    stop: float | None = None,
    values: Mapping[str, Any] | None = None,
    out: Path | None = None,
) -> Run:
    """Run an FMU and return its inputs and outputs over time, under their plain names.

    `inputs` is a CSV file (time, then inputs by name; straight lines between rows, sampled and
    held at each communication step); inputs without a column stay at their start value. `values`
    are parameters, start values and constant inputs. `out` saves the run, also one that fails.
    Raise FmuError, FileError, ParameterError or SimulationError.
    """
    block = Fmu(path, **dict(values or {}))
    step, stop = default_experiment(path, step, stop)
    table = None if inputs is None else read_table(inputs, block.inputs, "input")
    diagram = Diagram(path.stem, step=step)
    diagram.add("fmu", block)
    starts = {v.name: v.start for v in read_description(path).modelVariables}
    for number, (name, unit) in enumerate(block.inputs.items()):
        if table is not None and name in table.columns:
            source: Any = Profile(table.points(name), unit=unit or "1")
        else:
            source = Constant(_number(starts[name]), unit=unit or "1")
        diagram.add(f"input{number}", source)
        diagram.connect(f"input{number}.y", f"fmu.{name}")
    names = {f"input{n}.y": name for n, name in enumerate(block.inputs)}
    names |= {f"fmu.{name}": name for name in block.outputs}
    try:
        run = _renamed(diagram.run(stop, record=list(names)), names)
    except SimulationError as error:
        part = _renamed(error.run, names)
        if out is not None:
            part.save(out)
            raise SimulationError(f"{error}; the rows up to there are in {out}", part) from error
        raise SimulationError(str(error), part) from error
    if out is not None:
        run.save(out)
    return run


def _renamed(run: Run, names: Mapping[str, str]) -> Run:
    columns = tuple(names[c] for c in run.columns)
    units = {names[port]: unit for port, unit in run.units.items()}
    return replace(run, columns=columns, units=units)


def _number(start: Any) -> float:
    if str(start).lower() in ("true", "false"):
        return float(str(start).lower() == "true")
    return float(start or 0.0)
