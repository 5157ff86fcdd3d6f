"""Zero-order Takagi-Sugeno inference."""

from dataclasses import dataclass
from typing import Any, Literal

from ...base.ops import minimum
from .sets import Triangles, UniformSets
from .tables import check_choice, check_size


@dataclass(frozen=True)
class Sugeno:
    """Zero-order Takagi-Sugeno inference of two inputs: the rules' numbers, weighted by degree.

    `rules[i][j]` is the number for row set i and column set j; the conjunction is "min" or
    "prod" (Simulink's default). Inputs are clipped to their universes. Raise ParameterError for a
    table of the wrong size, an unknown conjunction, or sets so narrow that no rule might fire.
    """

    rows: UniformSets
    columns: UniformSets
    rules: tuple[tuple[float, ...], ...]
    conjunction: Literal["min", "prod"] = "min"

    def __post_init__(self) -> None:
        check_size(self.rules, len(self.rows.labels), len(self.columns.labels))
        check_choice("conjunction", self.conjunction, ("min", "prod"))
        self.rows.check_coverage("rows")
        self.columns.check_coverage("columns")

    def __call__(self, row: Any, column: Any) -> Any:
        """Return the output for a value of each input."""
        row_degrees = _applying(self.rows, self.rows.position(row))
        column_degrees = _applying(self.columns, self.columns.position(column))
        total: Any = 0.0
        weighted: Any = 0.0
        product = self.conjunction == "prod"
        for i, a in row_degrees:
            numbers = self.rules[i]
            for j, b in column_degrees:
                degree = a * b if product else minimum(a, b)
                total = total + degree
                weighted = weighted + degree * numbers[j]
        return weighted / total


def _applying(sets: UniformSets, position: Any) -> list[tuple[int, Any]]:
    """Return (place, degree) of the sets that apply: on floats two triangles."""
    if isinstance(position, float) and isinstance(sets, Triangles):
        k, first, second = sets.active(position)
        return [(k, first), (k + 1, second)]
    return list(enumerate(sets.degrees(position)))
