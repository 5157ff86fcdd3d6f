"""Many runs of one diagram, with parameters drawn anew for each: seeded, and counted as a whole."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..cosim import Run, SimulationError
from ..cosim.scenario import Scenario
from .case import Case
from .metrics import Metrics
from .results import Results

if TYPE_CHECKING:
    import pandas as pd

Draws = Mapping[str, float]  # spelled "block.parameter", or free names that `scenario` reads


def no_scenario(drawn: Draws) -> Scenario | None:
    """Return None: nothing happens on the way."""
    return None


@dataclass(frozen=True, kw_only=True)
class Ensemble(Case):
    """`runs` runs of a diagram.

    `draw` gives a run's numbers from a generator of its own, seeded with (seed, number of the
    run), so that any run can be repeated alone. Those spelled "block.parameter" are set; `scenario`
    makes of the others what happens on the way. `measure` gives the metrics of each run, a row
    of the samples beside the numbers drawn, and `summarise` the metrics of all.
    """

    draw: Callable[[np.random.Generator], Draws]
    summarise: "Callable[[pd.DataFrame], Metrics]"
    runs: int
    seed: int
    scenario: Callable[[Draws], Scenario | None] = field(default=no_scenario)
    units: Mapping[str, str] = field(default_factory=dict)  # of the columns that metrics lack

    def drawn(self, number: int) -> Draws:
        """Return the numbers of one run."""
        return self.draw(np.random.default_rng([self.seed, number]))

    def run(self, number: int) -> Run:
        """Return one run, as it is in the ensemble."""
        return self._run(self.drawn(number))

    def _run(self, drawn: Draws) -> Run:
        values = {name: value for name, value in drawn.items() if "." in name}
        diagram = self.diagram.with_values(values)
        return diagram.run(
            self.stop, record=self.record, scenario=self.scenario(drawn), progress=False
        )

    @property
    def count(self) -> int:
        """How many runs it takes."""
        return self.runs

    def collect(self, results: Results, progress: Callable[[int], object]) -> None:
        """Run all, and put samples and summary into the results, also when a run fails.

        The first run's signals are kept as the trace, or those of the run that fails.
        """
        rows: list[dict[str, Any]] = []
        try:
            for number in range(self.runs):
                drawn = self.drawn(number)
                run = self._run(drawn)
                if number == 0:
                    results.add(self, run, {})
                rows.append({"run": number, **drawn, **self.measure(run)})
                progress(1)
        except SimulationError as error:
            results.add(self, error.run, {})
            words = f"run {len(rows)} of seed {self.seed}: {error}"
            raise SimulationError(words, error.run) from error
        finally:
            results.add_samples(self, rows)


def spread(samples: "pd.DataFrame", column: str) -> Metrics:
    """Return mean, standard deviation and the extremes of a column of samples.

    Named after the column: "stop_error" gives `mean_stop_error`, `sd_stop_error` (of the sample)
    and `largest_stop_error`, the largest |stop_error|. None without a number.
    """
    values = samples[column].dropna().to_numpy(dtype=float)
    names = (f"mean_{column}", f"sd_{column}", f"largest_{column}")
    if len(values) == 0:
        return dict.fromkeys(names)
    found = (np.mean(values), np.std(values, ddof=1), np.max(np.abs(values)))
    return dict(zip(names, map(float, found), strict=True))
