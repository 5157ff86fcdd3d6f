"""One run of a study: an experiment under one controller; and running many of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..base.errors import RailcosimError
from ..cosim import Diagram, Run, SimulationError
from .results import Results

Metrics = dict[str, float | None]


@dataclass(frozen=True)
class Case:
    """A diagram to run to `stop` (s) and what to measure on the run."""

    experiment: str
    controller: str
    diagram: Diagram
    stop: float
    measure: Callable[[Run], Metrics]
    record: tuple[str, ...] | None = None
    seeds: Mapping[str, int] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The experiment's and controller's name."""
        return f"{self.experiment}-{self.controller}"


def with_overrides(cases: Sequence[Case], overrides: Mapping[str, Any]) -> list[Case]:
    """Return the cases with "block.parameter" values set wherever that parameter exists.

    An override that fits no case at all, or whose value is refused, raises that error.
    """
    changed = list(cases)
    for spelling, value in overrides.items():
        refusal: RailcosimError | None = None
        fits = 0
        for i, case in enumerate(changed):
            block, _, parameter = spelling.partition(".")
            known = case.diagram.blocks.get(block)
            if known is not None and parameter in known.parameters():
                diagram = case.diagram.with_values({spelling: value})
                changed[i] = replace(case, diagram=diagram)
                fits += 1
            elif refusal is None:
                try:
                    case.diagram.with_values({spelling: value})
                except RailcosimError as error:
                    refusal = error
        if not fits and refusal is not None:
            raise refusal
    return changed


def run_cases(study: str, cases: Sequence[Case], units: Mapping[str, str]) -> Results:
    """Run every case in turn; a case that fails ends the runs, and the results say so."""
    from tqdm import tqdm

    results = Results(study, dict(units))
    with tqdm(cases, desc=study, unit=" runs", delay=2.0, disable=None, leave=False) as bar:
        for case in bar:
            bar.set_postfix_str(case.name)
            try:
                run = case.diagram.run(case.stop, record=case.record, progress=False)
            except SimulationError as error:
                results.add(case, error.run, {})
                results.failure = f"{case.name}: {error}"
                break
            except RailcosimError as error:
                results.failure = f"{case.name}: {error}"
                break
            results.add(case, run, case.measure(run))
    return results
