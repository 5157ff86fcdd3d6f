"""The values of a schedule's registers: at the start, and from one plan to the next."""

from collections.abc import Mapping, Sequence
from typing import Any

from .schedule.schedule import Schedule


def at_start(schedule: Schedule, values: Sequence[Any], signals: Sequence[Any]) -> list[Any]:
    """Return the values with the signals, and their pasts, as they are at the start."""
    found = dict(zip(schedule.registers, values, strict=True))
    for j, value in enumerate(signals):
        found[f"y{j}"] = value
        for past in (f"p{j}", f"z{j}"):
            if past in found:
                found[past] = value
    return list(found.values())


def carried(before: Mapping[str, Any], schedule: Schedule) -> list[Any]:
    """Return the values for a new schedule, from those of the one before by label.

    Events are announced anew: a parameter may have moved them.
    """
    triples = zip(schedule.registers, schedule.labels, schedule.start, strict=True)
    found = {
        register: value if register[0] == "e" else before.get(label, value)
        for register, label, value in triples
    }
    for register, value in found.items():
        if register[0] == "p" and value is None:
            found[register] = found[f"y{register[1:]}"]
    return list(found.values())
