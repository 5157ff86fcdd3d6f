"""All experiments of the study."""

from ..case import Case
from .gear_cases import gear_cases
from .handling_cases import handling_cases
from .tracking_cases import tracking_cases
from .train_cases import train_cases


def cases() -> list[Case]:
    """Return every run of the study; builds the trains' FMUs, and finds our plan."""
    return [*cases_without_handling(), *handling_cases()]


def cases_without_handling() -> list[Case]:
    """Return the runs on the paper's experiments."""
    return [*tracking_cases(), *train_cases(), *gear_cases()]
