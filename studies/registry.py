"""The studies by name."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.errors import RailcosimError, listing, suggest

if TYPE_CHECKING:
    from .case import Case
    from .ledger import Entry
    from .results import Results


def no_tables(folder: Path) -> list[Path]:
    """Write nothing."""
    return []


@dataclass(frozen=True)
class Study:
    """A study's face: what it runs, how it judges the paper, what it draws.

    `tables` writes tables that need no run into a folder and returns their files.
    """

    name: str
    title: str
    source: str
    cases: "Callable[[], list[Case]]"
    judge: "Callable[[Results], list[Entry]]"
    figures: "Callable[[Results], dict[str, Any]]"
    tables: Callable[[Path], list[Path]] = no_tables


# name -> (module, one line)
STUDIES = {
    "adaptive-fuzzy": (
        ".adaptive_fuzzy",
        "adaptive fuzzy speed regulation with a variable universe, under ATP",
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
