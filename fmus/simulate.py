"""One FMU, run alone with inputs from a file."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..base.errors import FmuError
from ..cosim import Constant, Diagram, Fmu, Profile, Run, SimulationError
from ..cosim.clock import rational
from ..cosim.fmu_file import read_description, start_of
from ..cosim.result import check_target
from .tables import read_table


@dataclass(frozen=True)
class Span:
    """Communication step, start and stop of a run in s, a whole number of steps apart."""

    step: float
    start: float
    stop: float

    @property
    def count(self) -> int:
        """Number of communication steps."""
        return int((rational(self.stop) - rational(self.start)) / rational(self.step))


def span(path: Path, step: float | None, stop: float | None) -> Span:
    """Return the span: as given, else the FMU's default experiment, else 500 steps of 10 s in all.

    A stop between two communication points is moved to the later one. Raise FmuError for times
    that are not positive.
    """
    experiment = read_description(path).defaultExperiment

    def declared(name: str) -> float | None:
        text = None if experiment is None else getattr(experiment, name)
        return None if text is None else float(text)

    start = declared("startTime") or 0.0
    if stop is None:
        stop = declared("stopTime") or start + 10.0
    if step is None:
        step = declared("stepSize") or (stop - start) / 500.0
    if not 0.0 < step < float("inf"):
        raise FmuError(f"step must be a positive time in s, not {step:g}")
    if not start < stop < float("inf"):
        raise FmuError(f"stop must be a time after the start at {start:g} s, not {stop:g}")
    steps = (rational(stop) - rational(start)) / rational(step)
    end = rational(start) + -(-steps.numerator // steps.denominator) * rational(step)
    return Span(step, start, float(end))


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
    block = Fmu.with_values(path, values or {})
    times = span(path, step, stop)
    if out is not None:
        check_target(out)
    table = None if inputs is None else read_table(inputs, block.inputs, "input")
    diagram = Diagram(path.stem, step=times.step)
    diagram.add("fmu", block)
    starts = {v.name: start_of(v) for v in read_description(path).modelVariables}
    for number, (name, unit) in enumerate(block.inputs.items()):
        if table is not None and name in table.columns:
            source: Any = Profile(table.points(name), unit=unit or "1")
        else:
            source = Constant(float(starts[name] or 0.0), unit=unit or "1")
        diagram.add(f"input{number}", source)
        diagram.connect(f"input{number}.y", f"fmu.{name}")
    names = {f"input{n}.y": name for n, name in enumerate(block.inputs)}
    names |= {f"fmu.{name}": name for name in block.outputs}
    try:
        run = _renamed(diagram.run(times.stop, start=times.start, record=list(names)), names)
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
