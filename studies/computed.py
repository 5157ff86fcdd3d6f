"""What a study computes without a diagram of its own: fits, optimal curves."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ..cosim import Diagram, Run
from .case import Case
from .metrics import Metrics
from .results import Results

Rows = Mapping[str, tuple[Metrics, Run | None]]


@dataclass(frozen=True, kw_only=True)
class Computed(Case):
    """An experiment whose `compute` returns the rows of all its controllers at once.

    Each is (metrics, signals to keep as its trace or None). It has no blocks: no override fits.
    """

    compute: Callable[[], Rows]

    @classmethod
    def of(
        cls, experiment: str, compute: Callable[[], Rows], seeds: Mapping[str, int] | None = None
    ) -> "Computed":
        """Return an experiment by its name, what computes it, and the seeds it used."""
        return cls(
            experiment, "all", Diagram(experiment, step=1.0), 0.0, _nothing, seeds=seeds or {},
            compute=compute,
        )  # fmt: skip

    def check(self) -> None:
        """There is no diagram to check."""

    def collect(
        self, results: Results, progress: Callable[[int], object], executor: Any = None
    ) -> None:
        """Compute, and put the rows into the results."""
        for name, (metrics, run) in self.compute().items():
            results.metrics.setdefault(self.experiment, {})[name] = dict(metrics)
            if run is not None:
                results.runs[self.experiment, name] = run
        if self.seeds:
            results.seeds[self.experiment] = dict(self.seeds)
        progress(1)


def _nothing(run: Run) -> Metrics:
    return {}
