"""The fuzzy relation of a rule base over discrete levels, and its max-min composition."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from ...base.errors import ParameterError
from ...base.ops import is_symbol, maximum, minimum, where
from .levels import Levels
from .tables import check_choice, check_consequents, check_size

LevelDefuzzifier = Literal["centroid", "mean_of_maxima"]
LEVEL_DEFUZZIFIERS = ("centroid", "mean_of_maxima")
Table = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, kw_only=True)
class Relation:
    """R = ∪ᵢⱼ (Eᵢ × ECⱼ) × Uᵢⱼ over levels: union max, product min.

    Station-stop paper, section 4.4. `rules[i][j]` is the place of the output set for row set i
    and column set j. Raise ParameterError for a table of the wrong size or a consequent that
    does not exist.
    """

    rows: Levels
    columns: Levels
    output: Levels
    rules: tuple[tuple[int, ...], ...]

    def __post_init__(self) -> None:
        check_size(self.rules, len(self.rows.labels), len(self.columns.labels))
        check_consequents(self.rules, len(self.output.labels))

    @cached_property
    def array(self) -> np.ndarray:
        """R, by level of the row, of the column and of the output; not to be written to."""
        e, ec, u = (np.array(part.memberships) for part in (self.rows, self.columns, self.output))
        shape = tuple(len(part.names) for part in (self.rows, self.columns, self.output))
        found = np.zeros(shape)
        for i, consequents in enumerate(self.rules):
            for j, k in enumerate(consequents):
                fires = np.minimum.outer(e[i], ec[j])
                np.maximum(found, np.minimum.outer(fires, u[k]), out=found)
        found.flags.writeable = False
        return found

    def compose(self, row: Sequence[Any], column: Sequence[Any]) -> list[Any]:
        """Return U' = (E' × EC') ∘ R, max over all level pairs of min(E', EC', R).

        `row` and `column` are fuzzy values: one degree for each level, floats or CasADi symbols.
        Raise ParameterError for another number of degrees.
        """
        for levels, value in ((self.rows, row), (self.columns, column)):
            if len(value) != len(levels.names):
                raise ParameterError(f"a fuzzy input needs {len(levels.names)} degrees")
        if not any(is_symbol(d) for d in (*row, *column)):
            pairs = np.minimum.outer(np.array(row), np.array(column))
            return np.minimum(pairs[:, :, None], self.array).max(axis=(0, 1)).tolist()
        result: list[Any] = [0.0] * len(self.output.names)
        for a, plane in zip(row, self.array.tolist(), strict=True):
            for b, degrees in zip(column, plane, strict=True):
                pair = minimum(a, b)
                result = [
                    old if d == 0.0 else maximum(old, minimum(pair, d))
                    for old, d in zip(result, degrees, strict=True)
                ]
        return result

    def infer(self, row: int, column: int) -> list[float]:
        """Return U' on line for a level of each input, by its place: singletons composed with R."""
        return self.compose(self.rows.singleton(row), self.columns.singleton(column))

    def defuzzify(self, degrees: Sequence[Any], how: LevelDefuzzifier = "centroid") -> Any:
        """Return the output's value: "centroid" Σ μ u / Σ μ, or the "mean_of_maxima".

        Sums go in pairs from both ends, so that mirrored sets give mirrored values to the bit.
        """
        check_choice("defuzzify", how, LEVEL_DEFUZZIFIERS)
        if how == "mean_of_maxima":
            highest: Any = 0.0
            for d in degrees:
                highest = maximum(highest, d)
            degrees = [where(d == highest, 1.0, 0.0) for d in degrees]
        moments = [d * u for d, u in zip(degrees, self.output.values, strict=True)]
        return _paired_sum(moments) / _paired_sum(degrees)

    def table(self, how: LevelDefuzzifier = "centroid") -> Table:
        """Return the query table, computed off line: the output's value for all pairs of levels.

        Raise ParameterError if no rule fires at some pair.
        """
        if not (self.array > 0.0).any(axis=2).all():
            raise ParameterError("no rule fires at some pair of levels")
        columns = range(len(self.columns.names))
        return tuple(
            tuple(self.defuzzify(self.infer(i, j), how) for j in columns)
            for i in range(len(self.rows.names))
        )


def _paired_sum(values: Sequence[Any]) -> Any:
    total: Any = 0.0
    half, odd = divmod(len(values), 2)
    for k in range(half):
        total = total + (values[k] + values[-1 - k])
    return total + values[half] if odd else total
