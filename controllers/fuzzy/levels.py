"""Fuzzy sets on a universe of discrete levels."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

from ...base.errors import ParameterError, listing
from ...base.ops import finite


@dataclass(frozen=True, kw_only=True)
class Levels:
    """A universe of named levels, and sets given by their membership at each level.

    `names` are the levels' names ("-0", "+0" …), `values` their numbers (two may share one, as
    −0 and +0 do) and `memberships[i][k]` is the degree of set i at level k, from 0 to 1. Raise
    ParameterError for sizes that do not match, names given twice, a degree out of range, a set
    that applies nowhere, or a level that belongs to no set.
    """

    labels: tuple[str, ...]
    names: tuple[str, ...]
    values: tuple[float, ...]
    memberships: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        for what, names in (("set", self.labels), ("level", self.names)):
            if not names or len(set(names)) != len(names):
                raise ParameterError(f"give each {what} a name of its own, not {listing(names)}")
        if len(self.values) != len(self.names) or list(self.values) != sorted(self.values):
            raise ParameterError("give each level its value, in rising order")
        if not all(finite(v) for v in self.values):
            raise ParameterError("a level's value must be a finite number")
        if len(self.memberships) != len(self.labels):
            raise ParameterError("give each set a row of memberships")
        for label, row in zip(self.labels, self.memberships, strict=True):
            self._check_row(label, row)
        for k, name in enumerate(self.names):
            if not any(row[k] > 0.0 for row in self.memberships):
                raise ParameterError(f"level {name} belongs to no set: no rule would fire there")

    def _check_row(self, label: str, row: Sequence[float]) -> None:
        if len(row) != len(self.names):
            raise ParameterError(f"set '{label}' needs {len(self.names)} degrees, not {len(row)}")
        if not all(finite(d) and 0.0 <= d <= 1.0 for d in row):
            raise ParameterError(f"set '{label}': a degree of membership lies from 0 to 1")
        if not any(row):
            raise ParameterError(f"set '{label}' applies nowhere")

    @classmethod
    def of(cls, sets: Mapping[str, Mapping[str, float]], levels: Mapping[str, float]) -> Self:
        """Return levels (name: value) with sets (label: {level's name: degree, where not 0}).

        Raise ParameterError for a level that does not exist, and as the class does.
        """
        for label, degrees in sets.items():
            for name in degrees:
                if name not in levels:
                    known = listing(levels)
                    raise ParameterError(f"set '{label}': no level '{name}'; levels: {known}")
        return cls(
            labels=tuple(sets),
            names=tuple(levels),
            values=tuple(float(v) for v in levels.values()),
            memberships=tuple(
                tuple(float(degrees.get(name, 0.0)) for name in levels) for degrees in sets.values()
            ),
        )

    def singleton(self, level: int) -> tuple[float, ...]:
        """Return the fuzzy value that is one level, by its place: 1 there and 0 elsewhere."""
        if not 0 <= level < len(self.names):
            raise ParameterError(f"level {level}: places go from 0 to {len(self.names) - 1}")
        return tuple(1.0 if k == level else 0.0 for k in range(len(self.names)))
