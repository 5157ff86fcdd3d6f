"""A case of a study as a campaign, from the command line: `railcosim sweep`."""

import ast
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.errors import ParameterError, RailcosimError, listing, suggest
from ..cosim.campaign import Campaign, Simulate
from .case import Case, with_overrides
from .ensemble import Ensemble
from .metrics import UNITS
from .registry import study_named

if TYPE_CHECKING:
    import pandas as pd

_CALL = re.compile(r"\s*([\w.]+)\s*\((.*)\)\s*", re.DOTALL)


def _uniform(low: float, high: float) -> Any:
    from scipy import stats

    return stats.uniform(low, high - low)


def _normal(mean: float, deviation: float) -> Any:
    from scipy import stats

    return stats.norm(mean, deviation)


def _triangular(low: float, mode: float, high: float) -> Any:
    from scipy import stats

    return stats.triang((mode - low) / (high - low), low, high - low)


def _integers(low: int, high: int) -> Any:
    from scipy import stats

    return stats.randint(low, high + 1)


def _linspace(low: float, high: float, count: int) -> list[float]:
    import numpy as np

    return np.linspace(low, high, count).tolist()


# As they are written on the command line, with what people know of them as arguments.
KINDS: dict[str, tuple[Callable[..., Any], str]] = {
    "uniform": (_uniform, "low, high"),
    "normal": (_normal, "mean, standard deviation (positive)"),
    "triangular": (_triangular, "low, mode, high"),
    "integers": (_integers, "low, high, both included"),
    "linspace": (_linspace, "low, high, count: a sweep"),
}


def parse_draws(texts: Sequence[str]) -> dict[str, Any]:
    """Return draws from "block.parameter=uniform(0.9, 1.1)" or "block.parameter=0.8,0.9,1.0".

    `stats.NAME(…)` is scipy's own distribution. Raise ParameterError for what is none of these.
    """
    draws: dict[str, Any] = {}
    for text in texts:
        name, equals, spec = text.partition("=")
        if not equals or not name or not spec.strip():
            raise ParameterError(
                f"--draw {text}: write block.parameter=uniform(0.9,1.1), or values to sweep: "
                "block.parameter=0.8,0.9,1.0"
            )
        if name.strip() in draws:
            raise ParameterError(f"--draw {text}: '{name.strip()}' is drawn twice; keep one")
        call = _CALL.fullmatch(spec)
        draws[name.strip()] = _made(text, *call.groups()) if call else _swept(text, spec)
    return draws


def _made(text: str, kind: str, arguments: str) -> Any:
    if kind.startswith("stats."):
        from scipy import stats

        make, meaning = getattr(stats, kind.removeprefix("stats."), None), "see scipy.stats"
    else:
        make, meaning = KINDS.get(kind, (None, ""))
    if make is None or not callable(make):
        raise ParameterError(
            f"--draw {text}: no distribution '{kind}'; there are: "
            f"{listing([*KINDS, 'stats.NAME'])}{suggest(kind, KINDS)}"
        )
    try:
        values = ast.literal_eval(f"({arguments},)")
        made = make(*values)
    except (ValueError, SyntaxError, TypeError, ZeroDivisionError):
        raise ParameterError(f"--draw {text}: {kind} takes numbers: {meaning}") from None
    if kind in KINDS and hasattr(made, "support") and not _sound(made):
        raise ParameterError(
            f"--draw {text}: there is no such distribution; {kind} takes {meaning}"
        )
    if not (isinstance(made, list) or hasattr(made, "ppf")):
        raise ParameterError(f"--draw {text}: {kind} is no distribution of one number")
    return made


def _sound(distribution: Any) -> bool:
    """Return whether a distribution's arguments make one: scipy gives nan for all else."""
    import numpy as np

    with np.errstate(invalid="ignore"):
        return bool(np.isfinite(distribution.ppf(0.5)))


def _swept(text: str, spec: str) -> list[Any]:
    values = []
    for word in spec.split(","):
        try:
            values.append(ast.literal_eval(word.strip()))
        except (ValueError, SyntaxError):
            raise ParameterError(f"--draw {text}: '{word}' is no value") from None
    return values


def campaign_of(
    study: str,
    *,
    case: str | None = None,
    draws: Mapping[str, Any] | None = None,
    overrides: Mapping[str, Any] | None = None,
    runs: int | None = None,
    seed: int | None = None,
    sampling: str = "random",
    traces: int = 0,
) -> Campaign:
    """Return a case of a study as a campaign.

    An ensemble draws what it draws in the study unless there are `draws`, which then take the
    place of all of these. Raise RailcosimError for a case that is not there or leaves a choice.
    """
    found = study_named(study)
    chosen = with_overrides([_chosen(found.name, found.cases(), case)], overrides or {})[0]
    if isinstance(chosen, Ensemble):
        made = chosen.campaign
    elif draws:
        made = Campaign(name=chosen.name, work=_simulated(chosen), draws={})
    else:
        raise RailcosimError(f"'{chosen.name}' draws nothing by itself: say what, by --draw")
    if draws:
        made = replace(made, draws=dict(draws), sampling=sampling, runs=runs)
    elif sampling != "random":
        raise RailcosimError(f"'{chosen.name}' draws in its own way: --sampling goes with --draw")
    return replace(
        made,
        name=f"{found.name} {chosen.name}",
        runs=made.runs if runs is None else runs,
        seed=made.seed if seed is None else seed,
        units={**UNITS, **_units(chosen, draws or {}), **made.units},
        traces=traces,
    )


def _chosen(study: str, cases: Sequence[Case], name: str | None) -> Case:
    names = [case.name for case in cases]
    if name is None and len(cases) == 1:
        return cases[0]
    if name is None:
        raise RailcosimError(f"{study} has several cases, choose by --case: {listing(names, 40)}")
    if name not in names:
        hint = suggest(name, names)
        raise RailcosimError(f"{study} has no case '{name}'; cases: {listing(names, 40)}{hint}")
    return cases[names.index(name)]


def _simulated(case: Case) -> Simulate:
    return Simulate(diagram=case.diagram, stop=case.stop, measure=case.measure, record=case.record)


def _units(case: Case, draws: Mapping[str, Any]) -> dict[str, str]:
    """Return the units of drawn FMU parameters, which declare them."""
    from ..cosim import Fmu
    from ..cosim.fmu.file import read_description, unit_of

    units: dict[str, str] = {}
    for spelling in draws:
        name, _, parameter = spelling.partition(".")
        block = case.diagram.blocks.get(name)
        if isinstance(block, Fmu):
            for variable in read_description(block.path).modelVariables:
                if variable.name == parameter:
                    units[spelling] = unit_of(variable) or ""
    return units


def sweep(options: Any, overrides: Mapping[str, Any]) -> int:
    """Run the command with its parsed options."""
    campaign = campaign_of(
        options.study,
        case=options.case,
        draws=parse_draws(options.draws),
        overrides=overrides,
        runs=options.runs,
        seed=options.seed,
        sampling=options.sampling,
        traces=options.traces,
    )
    folder = Path(options.out or Path("results", "sweeps", campaign.name.replace(" ", "-")))
    table = campaign.run(
        folder, executor=options.scheduler, workers=options.workers, fresh=options.fresh
    )
    print(_summary(table, campaign))
    failures = table.loc[table["error"].notna(), ["run", "error"]].to_numpy().tolist()
    failed = len({number for number, _ in failures})
    words = f"{campaign.count} runs" + (f", {failed} of them failed" if failed else "")
    print(f"{words}; {folder / 'table.parquet'}")
    if failed == 0:
        return 0
    print("the first that failed: run {}, {}".format(*failures[0]))
    return 1


def _summary(table: "pd.DataFrame", campaign: Campaign) -> str:
    """Return mean, deviation and extremes of every column of numbers."""
    import numpy as np

    units = table.attrs["units"]
    numbers = table.drop(columns="run").select_dtypes("number")
    lines = [f"{'':32}{'mean':>12}{'sd':>12}{'min':>12}{'max':>12}"]
    for name in numbers.columns:
        values = numbers[name].to_numpy(dtype=float)
        values = values[np.isfinite(values)]
        head = f"{name} [{units[name]}]" if units[name] else name
        if len(values) == 0:
            lines.append(f"{head:32}{'–':>12}")
            continue
        deviation = values.std(ddof=1) if len(values) > 1 else 0.0
        cells = (values.mean(), deviation, values.min(), values.max())
        lines.append(f"{head:32}" + "".join(f"{cell:12.4g}" for cell in cells))
    return "\n".join(lines)
