"""All experiments of the study, in the order in which they are run."""

from ..case import Case
from . import line_cases, models, spreads, stopping


def cases() -> list[Case]:
    """Return every case; builds the train's FMUs and plans the whole runs."""
    return [*models.cases(), *stopping.cases(), *spreads.cases(), *line_cases.cases()]
