"""Rule tables: read as printed, and checked."""

from collections.abc import Sequence
from typing import Any

from ...base.errors import ParameterError, listing


def rule_table(
    text: str, rows: int, columns: int, labels: Sequence[str]
) -> tuple[tuple[int, ...], ...]:
    """Read a rule table as printed: one line a row, a consequent's label in each cell.

    Every cell must be filled, so that a rule fires wherever the inputs lie. Raise ParameterError
    for a wrong size or an unknown label.
    """
    lines = [line.split() for line in text.strip().splitlines()]
    if len(lines) != rows or any(len(line) != columns for line in lines):
        raise ParameterError(f"the rule table must have {rows} rows of {columns} consequents")
    for line in lines:
        for label in line:
            if label not in labels:
                raise ParameterError(f"no set '{label}' in the output; sets: {listing(labels)}")
    return tuple(tuple(labels.index(label) for label in line) for line in lines)


def check_size(rules: Sequence[Sequence[Any]], rows: int, columns: int) -> None:
    """Raise ParameterError unless the rules fill a table of this size."""
    if len(rules) != rows or any(len(row) != columns for row in rules):
        raise ParameterError(
            f"the rules must be {rows} rows of {columns}: where a rule is missing none might fire"
        )


def check_consequents(rules: Sequence[Sequence[int]], count: int) -> None:
    """Raise ParameterError unless every rule names one of `count` output sets by its place."""
    if any(not isinstance(k, int) or not 0 <= k < count for row in rules for k in row):
        raise ParameterError("a rule names an output set that does not exist")


def check_choice(name: str, value: Any, choices: Sequence[str]) -> None:
    """Raise ParameterError unless an option is one of its choices."""
    if value not in choices:
        words = [f"'{choice}'" for choice in choices]
        known = f"{', '.join(words[:-1])} or {words[-1]}"
        raise ParameterError(f"{name} is {known}, not {value!r}")
