"""The usual work of a campaign: a diagram, run with the numbers drawn, and measured."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from ..algorithms import Master
from ..diagram import Diagram
from ..results.recording import Recording
from ..results.result import Run, SimulationError
from ..runner import Runner
from ..scenario import Scenario
from .work import Drawn, Rows


def no_scenario(drawn: Drawn) -> Scenario | None:
    """Return None: nothing happens on the way."""
    return None


@dataclass(frozen=True, kw_only=True)
class Simulate:
    """A diagram run to `stop` (s).

    The numbers drawn that are spelled "block.parameter" are set; `scenario` makes of them, and of
    those with free names, what happens on the way. `measure` gives the row, or several.
    """

    diagram: Diagram
    stop: float | Fraction
    measure: Callable[[Run], Rows]
    scenario: Callable[[Drawn], Scenario | None] = no_scenario
    record: Sequence[str] | Recording | None = None
    algorithm: Master | None = None
    engine: str = "auto"

    def run(self, drawn: Drawn, generator: np.random.Generator | None = None) -> Run:
        """Return one run; raise SimulationError, with the rows so far, if it fails."""
        return self.diagram.with_values(_values(drawn)).run(
            self.stop,
            record=self.record,
            scenario=self.scenario(drawn),
            algorithm=self.algorithm,
            engine=self.engine,
            progress=False,
        )

    def measured(self, run: Run) -> Rows:
        """Return what `measure` makes of a run."""
        return self.measure(run)

    def __call__(self, drawn: Drawn, generator: np.random.Generator | None = None) -> Rows:
        """Run and measure."""
        return self.measure(self.run(drawn, generator))

    def check(self, names: Iterable[str]) -> None:
        """Raise DiagramError or ParameterError for a name drawn that no run could set."""
        for name in names:
            block, dot, parameter = name.partition(".")
            if dot and parameter not in self.diagram.block(block).parameters():
                self.diagram.with_values({name: 1.0})  # an FMU's start value, perhaps

    def prepared(self) -> "Prepared":
        """Return the same for many runs in one thread."""
        return Prepared(self)


class Prepared:
    """A simulation that keeps its runner: the FMUs and the program that is compiled for them."""

    def __init__(self, simulate: Simulate) -> None:
        self._simulate = simulate
        self._runner: Runner | None = None

    def run(self, drawn: Drawn, generator: np.random.Generator) -> Run:
        """Return one run; raise SimulationError, with the rows so far, if it fails."""
        simulate = self._simulate
        scenario = simulate.scenario(drawn)
        if self._runner is None:
            self._runner = simulate.diagram.runner(
                simulate.stop,
                record=simulate.record,
                algorithm=simulate.algorithm,
                engine=simulate.engine,
            )
        try:
            return self._runner.run(_values(drawn), scenario)
        except SimulationError:
            raise
        except BaseException:  # stopped by its timeout, somewhere: nothing of it is used again
            self.close()
            raise

    def measured(self, run: Run) -> Rows:
        """Return what `measure` makes of a run."""
        return self._simulate.measure(run)

    def close(self) -> None:
        """Free the FMUs."""
        runner, self._runner = self._runner, None
        if runner is not None:
            runner.close()


def _values(drawn: Drawn) -> dict[str, Any]:
    return {name: value for name, value in drawn.items() if "." in name}
