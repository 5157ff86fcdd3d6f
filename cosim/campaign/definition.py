"""The campaign: what is run, how often, with which numbers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..results.result import Run
from .draws import Draws, Plan, generator_of, make_plan
from .errors import CampaignError
from .work import Simulation, Work, plain_row, plain_rows

if TYPE_CHECKING:
    import pandas as pd

Traces = int | str | Callable[[int, str | None], bool]


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """Many runs of some work, with numbers drawn or swept.

    - `work`: `Simulate(diagram=…, stop=…, measure=…)`, or any function `work(drawn, generator)`
      that returns a row (a mapping of metrics) or a list of rows.
    - `draws`: by name ("block.parameter", or a free name that the work reads) a frozen
      distribution of scipy.stats, or a list of values to sweep; a list of such points, each a
      mapping of names to values; or a function of the run's generator that returns one.
    - `runs`: how many; with swept values or points, how many at each (default: one).
    - `sampling` of the distributions: "random", "latin_hypercube" or "sobol".
    - `seed`: run n has the generator `numpy.random.default_rng([seed, n])`.
    - `units` of the table's columns.
    - `traces`: the signals that are kept: of every n-th run (0: none), "failed", or a function of
      the run's number and error (None if it did not fail).
    - `timeout` (s) of one run.

    Raise CampaignError for what is none of that.
    """

    name: str
    work: Work
    draws: Draws = field(default_factory=dict)
    runs: int | None = None
    seed: int = 0
    sampling: str = "random"
    units: Mapping[str, str] = field(default_factory=dict)
    traces: Traces = 0
    timeout: float | None = None

    def __post_init__(self) -> None:
        def whole(value: Any, least: int) -> bool:
            return isinstance(value, int) and not isinstance(value, bool) and value >= least

        problems = {
            "runs is a positive whole number": self.runs is None or whole(self.runs, 1),
            "seed is a whole number that is not negative": whole(self.seed, 0),
            "timeout is a positive time in s": self.timeout is None or self.timeout > 0.0,
            "traces is a number, 'failed' or a function": self.traces == "failed"
            or callable(self.traces)
            or whole(self.traces, 0),
            "work is a function, or Simulate(…)": callable(self.work),
        }
        for words, good in problems.items():
            if not good:
                raise CampaignError(f"campaign '{self.name}': {words}")

    @cached_property
    def plan(self) -> Plan:
        """The numbers of all runs, as far as they do not come from a function."""
        return make_plan(self.draws, runs=self.runs, seed=self.seed, sampling=self.sampling)

    @property
    def count(self) -> int:
        """How many runs there are."""
        return self.plan.count

    def run(
        self,
        folder: str | Path | None = None,
        *,
        executor: Any = None,
        workers: int | None = None,
        fresh: bool = False,
        progress: bool | Callable[[int], object] = True,
    ) -> "pd.DataFrame":
        """Run all that is not done yet and return the table, one row a run (or several).

        The folder keeps what is done: started again after whatever end, the campaign goes on, and
        its table.parquet has the same bytes as one never interrupted. Without a folder nothing is
        kept. A folder with another campaign raises CampaignError, unless it is to begin `fresh`.

        `executor`: "processes" (the default; `workers` of them, one for each processor), "serial",
        an open `Processes(…)`, a Dask scheduler's address or client, an executor of
        concurrent.futures, or a function that makes one. `progress`: a bar with rate and time
        left on a terminal, or a function that is told of every so many runs more.

        Columns: run, seed, the numbers drawn, the metrics, error (None where there is none).
        """
        from .conduct import conduct

        where = None if folder is None else Path(folder)
        return conduct(
            self, where, executor=executor, workers=workers, fresh=fresh, progress=progress
        )

    def drawn(self, number: int) -> dict[str, Any]:
        """Return the numbers of one run."""
        return self._drawn(number)[0]

    def repeat(self, number: int) -> Run:
        """Return one run as it is in the campaign, with all its signals.

        Raise SimulationError if it failed there, CampaignError if the work is no simulation.
        """
        if not isinstance(self.work, Simulation):
            raise CampaignError(f"the work of '{self.name}' keeps no signals; see rows()")
        return self.work.run(*self._drawn(number))

    def rows(self, number: int) -> list[dict[str, Any]]:
        """Return one run's metrics as they are in the table; raise what it raised there."""
        drawn, generator = self._drawn(number)
        return plain_rows(self.work(drawn, generator), drawn)

    def _drawn(self, number: int) -> Any:
        if not 0 <= number < self.count:
            raise CampaignError(f"'{self.name}' has runs 0 to {self.count - 1}, no run {number}")
        generator = generator_of(self.seed, number)
        drawn = self.plan.drawn(number)
        if drawn is None:
            assert self.plan.function is not None
            drawn = self.plan.function(generator)
        return plain_row(drawn), generator

    @property
    def keeps(self) -> Callable[[int, str | None], bool]:
        """Whether a run's signals are kept, by its number and error."""
        if callable(self.traces):
            return self.traces
        return partial(_keeps, self.traces)


def _keeps(traces: int | str, number: int, error: str | None) -> bool:
    if isinstance(traces, str):
        return error is not None
    return traces > 0 and number % traces == 0
