"""One run of a study: an experiment under one controller; and running many of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..base.errors import DiagramError, ParameterError, RailcosimError, listing, suggest
from ..cosim import Diagram, Recording, Run, SimulationError
from .metrics import Metrics
from .results import Results


@dataclass(frozen=True)
class Case:
    """A diagram to run to `stop` (s) and what to measure on the run.

    What makes the experiment what it is stays so under overrides: the parameters in `own` keep
    their values, and those in `factors` are multiplied after any override ("gain +20 %" of what
    the gain then is). Both are spelled "block.parameter".

    A case is `long` if it takes ten seconds or more: several such are run side by side from the
    start, others once it shows that they take long.
    """

    experiment: str
    controller: str
    diagram: Diagram
    stop: float
    measure: Callable[[Run], Metrics]
    record: tuple[str, ...] | Recording | None = None
    own: tuple[str, ...] = ()
    factors: Mapping[str, float] = field(default_factory=dict)
    seeds: Mapping[str, int] = field(default_factory=dict)
    long: bool = False

    @property
    def name(self) -> str:
        """The experiment's and controller's name."""
        return f"{self.experiment}-{self.controller}"

    @property
    def count(self) -> int:
        """How many runs it takes."""
        return 1

    def check(self) -> None:
        """Raise RailcosimError for what would not run, such as a period that does not fit."""
        self.diagram.plan()

    def collect(
        self, results: Results, progress: Callable[[int], object], executor: Any = None
    ) -> None:
        """Run, and put what came out into the results, also when the run ends early.

        `executor` is for cases of many runs, see Campaign.run. This may happen in a worker
        process, with results of its own that are then taken over.
        """
        try:
            run = self.diagram.run(self.stop, record=self.record, progress=False)
        except SimulationError as error:
            results.add(self, error.run, {})
            raise
        results.add(self, run, self.measure(run))
        progress(1)


def with_overrides(cases: Sequence[Case], overrides: Mapping[str, Any]) -> list[Case]:
    """Return the cases with "block.parameter" values set wherever that parameter exists.

    Parameters that an experiment itself sets stay as they are there. An override that fits no
    case at all, or only such that set it themselves, or whose value is refused, raises that error.
    """
    changed = list(cases)
    for spelling, value in overrides.items():
        fitting = [i for i, case in enumerate(changed) if _has(case, spelling)]
        if not fitting:
            raise _refusal(changed, spelling)
        if all(spelling in changed[i].own for i in fitting):
            names = listing(dict.fromkeys(changed[i].experiment for i in fitting))
            raise ParameterError(
                f"{spelling} makes {names} what it is, and no other run has it: it cannot be set"
            )
        for i in fitting:
            case = changed[i]
            if spelling not in case.own:
                changed[i] = replace(case, diagram=case.diagram.with_values({spelling: value}))
    return [_perturbed(case) for case in changed]


def _has(case: Case, spelling: str) -> bool:
    block, _, parameter = spelling.partition(".")
    known = case.diagram.blocks.get(block)
    return known is not None and parameter in known.parameters()


def _refusal(cases: Sequence[Case], spelling: str) -> RailcosimError:
    """Return the error for an override that fits nowhere, with all that the cases have."""
    block, dot, parameter = spelling.partition(".")
    if not dot:
        return ParameterError(f"--set {spelling}: not spelled block.parameter")
    known: dict[str, None] = {}
    blocks: dict[str, None] = {}
    for case in cases:
        for name, found in case.diagram.blocks.items():
            blocks[name] = None
            if name == block:
                known |= dict.fromkeys(found.parameters())
    if block not in blocks:
        return DiagramError(
            f"no block '{block}' in the study; blocks: {listing(blocks)}{suggest(block, blocks)}"
        )
    return ParameterError(
        f"no '{block}' of the study has a parameter '{parameter}'; there are: "
        f"{listing(known, 40)}{suggest(parameter, known)}"
    )


def _perturbed(case: Case) -> Case:
    """Return the case with its factors applied."""
    diagram = case.diagram
    for spelling, factor in case.factors.items():
        block, _, parameter = spelling.partition(".")
        value = diagram.blocks[block].parameters()[parameter]
        diagram = diagram.with_values({spelling: value * factor})
    return replace(case, diagram=diagram, factors={})


def run_cases(study: str, cases: Sequence[Case], units: Mapping[str, str]) -> Results:
    """Run every case; one that fails ends the runs, and the results say so.

    The cases come from `with_overrides`, which applies their factors. Where there is enough to do
    they are run side by side in worker processes, one for each processor; what comes out is the
    same as that of one after the other.
    """
    from tqdm import tqdm

    from ..cosim.campaign import Processes
    from .running import run_all

    results = Results(study, dict(units))
    total = sum(case.count for case in cases)
    with (
        Processes() as pool,
        tqdm(total=total, desc=study, unit=" runs", delay=2.0, disable=None, leave=False) as bar,
    ):
        run_all(cases, results, pool, bar)
    return results
