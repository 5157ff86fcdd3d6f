"""Many runs of one diagram, with parameters drawn anew for each, and counted as a whole."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..cosim import Run, SimulationError
from ..cosim.campaign import Campaign, CampaignError, Drawn, Rows, Simulate
from ..cosim.campaign.draws import Draws
from ..cosim.campaign.simulate import no_scenario
from ..cosim.scenario import Scenario
from .case import Case
from .metrics import Metrics
from .results import Results

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class Ensemble(Case):
    """A campaign of `runs` runs as a case of a study; it is in `campaign`.

    `draws` gives the runs' numbers, as a Campaign's: by name, or by a function of a run's own
    generator. Those spelled "block.parameter" are set; `scenario` makes of the others what happens
    on the way. `measure` gives the metrics of each run, a row of the samples beside the numbers
    drawn, and `summarise` the metrics of all.

    Runs that are no single run of the diagram have `work`: a function of the case, which has the
    diagram with what was set from outside, of the numbers drawn and of the generator. It returns a
    row or several.
    """

    draws: Draws
    summarise: "Callable[[pd.DataFrame], Metrics]"
    runs: int
    seed: int
    scenario: Callable[[Drawn], Scenario | None] = field(default=no_scenario)
    work: "Callable[[Ensemble, Drawn, np.random.Generator], Rows] | None" = None
    sampling: str = "random"
    units: Mapping[str, str] = field(default_factory=dict)  # of the columns that metrics lack

    @property
    def campaign(self) -> Campaign:
        """The runs as a campaign: any of them can be repeated alone."""
        simulate = Simulate(
            diagram=self.diagram,
            stop=self.stop,
            measure=self.measure,
            scenario=self.scenario,
            record=self.record,
        )
        return Campaign(
            name=self.name,
            work=simulate if self.work is None else partial(self.work, self),
            draws=self.draws,
            runs=self.runs,
            seed=self.seed,
            sampling=self.sampling,
            units=self.units,
        )

    @property
    def count(self) -> int:
        """How many runs it takes."""
        return self.campaign.count

    def collect(
        self, results: Results, progress: Callable[[int], object], executor: Any = None
    ) -> None:
        """Run all, and put samples and summary into the results, also when runs fail.

        The first run's signals are kept as the trace, or those of the first that fails, whose
        error is raised when all others are done.
        """
        campaign = self.campaign
        samples = campaign.run(executor=executor, progress=progress)
        failed = {
            int(number): error
            for number, error in zip(samples["run"], samples["error"], strict=True)
            if isinstance(error, str)
        }
        results.add_samples(self, samples, failed=bool(failed))
        number = min(failed, default=0)
        run: Run | None = None
        try:
            if self.work is None:
                run = campaign.repeat(number)
        except SimulationError as error:
            run = error.run
        results.add(self, run, {})
        if failed:
            words = f"run {number} of seed {self.seed}: {failed[number]}"
            words += f" ({len(failed)} of {campaign.count} runs failed)"
            raise CampaignError(words) if run is None else SimulationError(words, run)


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
