"""The ledger: a paper's claims, each judged by what the run measured."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .results import Results


@dataclass(frozen=True)
class Entry:
    """A claim, where the paper makes it, what was measured, the verdict and how it was read."""

    claim: str
    where: str
    measured: str
    verdict: str
    interpretation: str


def verdict(conditions: Mapping[str, bool | None] | bool | None) -> str:
    """Return the verdict on a claim from one result, or from those under several conditions.

    All true: "holds"; none: "does not hold"; else "holds if …" with those that are. A condition
    that could not be measured (None) makes the claim one that "cannot be verified".
    """
    if not isinstance(conditions, Mapping):
        conditions = {"": conditions}
    if not conditions or any(result is None for result in conditions.values()):
        return "cannot be verified"
    good = [condition for condition, result in conditions.items() if result]
    if len(good) == len(conditions):
        return "holds"
    return f"holds if {' or '.join(good)}" if good else "does not hold"


def less(a: float | None, b: float | None, *, margin: float = 0.0) -> bool | None:
    """Return whether a < (1 − margin) · b, or None if either was not measured.

    Two times that never came (infinity) are not less than each other.
    """
    return None if a is None or b is None else a < (1.0 - margin) * b


def every(*results: bool | None) -> bool | None:
    """Return whether all hold, or None if any could not be measured."""
    return None if any(result is None for result in results) else all(results)


def number(value: float | None, unit: str, digits: int = 2) -> str:
    """Return a measured value for a sentence; "never" for a time that did not come."""
    return "never" if value is None else f"{value:.{digits}f} {unit}".rstrip()


def row(
    results: "Results", experiment: str, metric: str, controllers: Iterable[str], unit: str
) -> str:
    """Return one metric of several controllers for a sentence."""
    return ", ".join(
        f"{name} {number(results.get(experiment, name, metric), unit)}" for name in controllers
    )
