"""The studies by name."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ..base.errors import RailcosimError, listing, suggest

if TYPE_CHECKING:
    from .case import Case
    from .ledger import Entry
    from .results import Results


@dataclass(frozen=True)
class Study:
    """A study's face: what it runs, how it judges the paper, what it draws."""

    name: str
    title: str
    source: str
    cases: "Callable[[], list[Case]]"
    judge: "Callable[[Results], list[Entry]]"
    figures: "Callable[[Results], dict[str, Any]]"


# name -> (module, one line)
STUDIES = {
    "soft-switching": (
        ".soft_switching",
        "T-S fuzzy soft switching between fuzzy and single-neuron PID speed control",
    ),
}


def study_named(name: str) -> Study:
    """Return a study; raise RailcosimError for an unknown name."""
    key = name.replace("_", "-")
    if key not in STUDIES:
        hint = suggest(key, STUDIES)
        raise RailcosimError(f"no study '{name}'; studies: {listing(STUDIES)}{hint}")
    return import_module(STUDIES[key][0], __package__).STUDY
