"""One FMU, run alone with inputs from a file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from ..base.errors import FileError, FmuError
from ..cosim import Constant, Diagram, Fmu, Profile, Run, SimulationError
from ..cosim.clock import rational
from ..cosim.fmu.file import is_ours, number_of, read_description, start_of
from ..cosim.results.result import check_target
from .tables import read_table


@dataclass(frozen=True)
class Span:
    """A run's communication step and start (s, exact) and its number of steps."""

    step: Fraction
    start: Fraction
    count: int

    @property
    def stop(self) -> Fraction:
        """Stop time in s."""
        return self.start + self.count * self.step


def span(path: Path, step: float | None, stop: float | None) -> Span:
    """Return the span: as given, else the FMU's default experiment, else 500 steps of 10 s in all.

    A stop between two communication points is moved to the later one. Raise FmuError for times
    that are not positive.
    """
    experiment = read_description(path).defaultExperiment

    def time(given: float | None, attribute: str) -> Fraction | None:
        value = number_of(experiment, attribute) if given is None else given
        if value is None:
            return None
        if not math.isfinite(value):
            raise FmuError(f"{attribute} must be a time in s, not {value:g}")
        return rational(value)

    start = time(None, "startTime") or Fraction(0)
    end = time(stop, "stopTime")
    end = start + 10 if end is None else end
    if end <= start:
        what = f"stop must be a time after the start at {float(start):g} s"
        raise FmuError(f"{what}, not {float(end):g} s")
    size = time(step, "stepSize")
    size = (end - start) / 500 if size is None else size
    if size <= 0:
        raise FmuError(f"step must be a positive time in s, not {float(size):g}")
    steps = (end - start) / size
    return Span(size, start, -(-steps.numerator // steps.denominator))


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
    # Who knows what another tool's FMU does: a crash shall cost an error, not the rows.
    block = Fmu.with_values(path, values or {}, isolated=not is_ours(read_description(path)))
    times = span(path, step, stop)
    if out is not None:
        check_target(out)
        if inputs is not None and Path(inputs).exists() and out.resolve() == Path(inputs).resolve():
            raise FileError(f"the result would overwrite the input {inputs}; choose another --out")
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
        run = diagram.run(times.stop, start=times.start, record=list(names)).renamed(names)
    except SimulationError as error:
        part = error.run.renamed(names)
        if out is not None:
            part.save(out)
            raise SimulationError(f"{error}; the rows up to there are in {out}", part) from error
        raise SimulationError(str(error), part) from error
    if out is not None:
        run.save(out)
    return run
