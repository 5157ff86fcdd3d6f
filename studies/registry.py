"""The studies by name."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.errors import ParameterError, RailcosimError, listing, suggest

if TYPE_CHECKING:
    from ..models.line import Section, Train
    from .case import Case
    from .ledger import Entry
    from .results import Results


def no_tables(folder: Path, results: "Results") -> list[Path]:
    """Write nothing."""
    return []


def nothing_unmet(results: "Results") -> list[str]:
    """Return nothing."""
    return []


@dataclass(frozen=True)
class Study:
    """A study's face: what it runs, how it judges the paper, what it draws.

    `tables` writes tables into a folder and returns their files. `on_line` makes
    the cases of one run of a train on a line, where the study has such, and `unmet` tells which of
    them did not go as planned.
    """

    name: str
    title: str
    source: str
    cases: "Callable[[], list[Case]]"
    judge: "Callable[[Results], list[Entry]]"
    figures: "Callable[[Results], dict[str, Any]]"
    tables: "Callable[[Path, Results], list[Path]]" = no_tables
    on_line: "Callable[[Section, Train], list[Case]] | None" = None
    unmet: "Callable[[Results], list[str]]" = nothing_unmet

    def cases_on_line(self, **way: str | None) -> "list[Case]":
        """Return the cases of a run between two stops: `line` and `train` are files, or None.

        Raise ParameterError for a study without a line, naming what was given, and where `from` or
        `to` is missing.
        """
        from ..models.line import beijing_line_5, metro_b, read_line, read_train

        if self.on_line is None:
            given = " and ".join(f"--{key}" for key, value in way.items() if value is not None)
            raise ParameterError(f"the study '{self.name}' has no line: it takes no {given}")
        line = beijing_line_5() if way["line"] is None else read_line(Path(way["line"]))
        train = metro_b() if way["train"] is None else read_train(Path(way["train"]))
        origin, target = way["from"], way["to"]
        if origin is None or target is None:
            names = listing([stop.name for stop in line.stops], 40)
            raise ParameterError(f"a run on a line needs --from and --to; stops: {names}")
        return self.on_line(line.section(origin, target), train)


# name -> (module, one line)
STUDIES = {
    "adaptive-fuzzy": (
        ".adaptive_fuzzy",
        "adaptive fuzzy speed regulation with a variable universe, under ATP",
    ),
    "heavy-haul": (
        ".heavy_haul",
        "coupler forces of 2 locomotives and 100 wagons under fuzzy adaptive PID",
    ),
    "precise-braking": (
        ".precise_braking",
        "the metro stop with electric and air brake: models, controllers, spread, whole runs",
    ),
    "soft-switching": (
        ".soft_switching",
        "T-S fuzzy soft switching between fuzzy and single-neuron PID speed control",
    ),
    "station-stop": (
        ".station_stop",
        "stopping at a platform mark by an offline fuzzy query table",
    ),
}


def study_named(name: str) -> Study:
    """Return a study; raise RailcosimError for an unknown name."""
    key = name.replace("_", "-")
    if key not in STUDIES:
        hint = suggest(key, STUDIES)
        raise RailcosimError(f"no study '{name}'; studies: {listing(STUDIES)}{hint}")
    return import_module(STUDIES[key][0], __package__).STUDY
