"""The columns of a log: their names, other names that are understood, and their units."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from ...base.errors import FileError, UnitError, listing, suggest
from ...base.units import parse

_HEADER = re.compile(r"\s*(?P<name>[^\[(]*?)\s*(?:[\[(]\s*(?P<unit>[^\])]*?)\s*[\])])?\s*")
_PLAIN = {"m/s^2": "m/s2", "m/s²": "m/s2", "cm/s^2": "cm/s2", "cm/s²": "cm/s2", "": "1", "-": "1"}


@dataclass(frozen=True)
class Column:
    """A column's unit, the other names it may bear, and whether a log must have it."""

    unit: str
    synonyms: tuple[str, ...] = ()
    needed: bool = True


COLUMNS = {
    "time": Column("s", ("t",)),
    "command": Column("m/s2", ("u", "acceleration_command")),
    "speed": Column("m/s", ("v", "velocity")),
    "air_brake": Column("1", ("air_brake_on", "brake_flag", "air"), needed=False),
    "gradient": Column("‰", ("slope",), needed=False),
    "run": Column("1", (), needed=False),
}


def find_columns(file: str, heads: Sequence[str]) -> dict[str, tuple[str, float]]:
    """Return for each column that a file has (its head, the factor into our unit).

    Raise FileError for a column that is missing or doubled, and for a unit that does not fit.
    """
    found: dict[str, tuple[str, float]] = {}
    for head in heads:
        match = _HEADER.fullmatch(head)
        plain = re.sub(r"[\s\-.]+", "_", match["name"].strip().lower()) if match else ""
        name = next((n for n, c in COLUMNS.items() if plain in (n, *c.synonyms)), None)
        if match is None or name is None:
            continue
        if name in found:
            raise FileError(
                f"{file}: columns '{found[name][0]}' and '{head}' both are the {name}; keep one"
            )
        found[name] = (head, _factor(file, name, head, match["unit"]))
    for name, column in COLUMNS.items():
        if column.needed and name not in found:
            near = suggest(name, heads) or suggest(name, [h.lower() for h in heads])
            raise FileError(
                f"{file}: no column '{name}' [{column.unit}]; columns: {listing(heads)}{near}"
            )
    return found


def _factor(file: str, name: str, head: str, unit: str | None) -> float:
    """Return what turns a value of a column into our unit."""
    wanted = COLUMNS[name].unit
    if unit is None or name == "run":
        return 1.0
    unit = _PLAIN.get(unit, unit)
    where = f"{file}, column '{head}'"
    try:
        given, ours = parse(unit), parse(wanted)
    except UnitError as error:
        raise FileError(f"{where}: {error}") from None
    if given.exponents != ours.exponents or given.offset:
        raise FileError(f"{where}: '{unit}' is not a unit of the {name}; write [{wanted}]")
    if name == "gradient" and unit == "1":
        return 1.0  # written without a unit, gradients are in ‰
    return given.factor / ours.factor
