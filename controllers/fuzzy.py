"""Fuzzy inference: triangular sets, min-max Mamdani and zero-order Takagi-Sugeno rule bases.

The same rule base runs on floats and on CasADi symbols. On floats only the sets that are active
are looked at (two for each input); on symbols all of them. Sets that are not active contribute
exact zeros, so both give the same bits.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from ..base.errors import ParameterError, listing
from ..base.ops import clip, maximum, minimum

SAMPLES = 101  # of the Simulink Fuzzy Logic Toolbox


@dataclass(frozen=True)
class Triangles:
    """Uniform triangular sets on a universe; the first and last set peak at its ends.

    Values outside the universe are clipped to it. Neighbours cross at one half and all degrees
    add up to one, so some set always applies.
    """

    low: float
    high: float
    labels: tuple[str, ...]

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise ParameterError(f"universe [{self.low}, {self.high}]: low must lie below high")
        if len(self.labels) < 2 or len(set(self.labels)) != len(self.labels):
            raise ParameterError("a universe needs two or more sets with different labels")

    @property
    def width(self) -> float:
        """Distance of two neighbouring peaks."""
        return (self.high - self.low) / (len(self.labels) - 1)

    def position(self, value: Any) -> Any:
        """Return where a value stands, counted in sets: 0 at the first peak, 1 at the second …"""
        return (clip(value, self.low, self.high) - self.low) / self.width

    def degrees(self, position: Any) -> list[Any]:
        """Return the membership of every set at a position."""
        return [
            maximum(0.0, minimum(position - (k - 1.0), (k + 1.0) - position))
            for k in range(len(self.labels))
        ]

    def active(self, position: float) -> tuple[int, float, float]:
        """Return (k, membership of set k, membership of set k+1) on floats; no other applies."""
        k = min(int(position), len(self.labels) - 2)
        return k, (k + 1.0) - position, position - k


def rule_table(text: str, rows: int, columns: int, labels: Sequence[str]) -> tuple[
    tuple[int, ...], ...
]:  # fmt: skip
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


def _check_rules(rules: Sequence[Sequence[Any]], rows: Triangles, columns: Triangles) -> None:
    if len(rules) != len(rows.labels) or any(len(r) != len(columns.labels) for r in rules):
        raise ParameterError(
            f"the rules must be {len(rows.labels)} rows of {len(columns.labels)}: "
            "where a rule is missing none might fire"
        )


@dataclass(frozen=True)
class Mamdani:
    """Min-max inference of two inputs: conjunction min, implication min, aggregation max.

    `rules[i][j]` is the place of the output set for row set i and column set j. `defuzzify` is
    "centroid" (exact, in closed form) or "sampled" (101 points, as Simulink's toolbox does).
    """

    rows: Triangles
    columns: Triangles
    output: Triangles
    rules: tuple[tuple[int, ...], ...]
    defuzzify: Literal["centroid", "sampled"] = "centroid"

    def __post_init__(self) -> None:
        _check_rules(self.rules, self.rows, self.columns)
        if any(not 0 <= k < len(self.output.labels) for row in self.rules for k in row):
            raise ParameterError("a rule names an output set that does not exist")
        if self.defuzzify not in ("centroid", "sampled"):
            raise ParameterError(f"defuzzify is 'centroid' or 'sampled', not {self.defuzzify!r}")

    def __call__(self, row: Any, column: Any) -> Any:
        """Return the output for a value of each input."""
        heights = self.heights(row, column)
        if self.defuzzify == "centroid":
            return centroid(self.output, heights)
        return sampled_centroid(self.output, heights)

    def heights(self, row: Any, column: Any) -> list[Any]:
        """Return how far each output set is filled."""
        r, c = self.rows.position(row), self.columns.position(column)
        heights: list[Any] = [0.0] * len(self.output.labels)
        if isinstance(r, float) and isinstance(c, float):
            i, r0, r1 = self.rows.active(r)
            j, c0, c1 = self.columns.active(c)
            upper, lower = self.rules[i], self.rules[i + 1]
            for k, a, b in (
                (upper[j], r0, c0),
                (upper[j + 1], r0, c1),
                (lower[j], r1, c0),
                (lower[j + 1], r1, c1),
            ):
                degree = a if a < b else b
                if degree > heights[k]:
                    heights[k] = degree
            return heights
        columns = self.columns.degrees(c)
        for i, a in enumerate(self.rows.degrees(r)):
            for j, b in enumerate(columns):
                k = self.rules[i][j]
                heights[k] = maximum(heights[k], minimum(a, b))
        return heights


def centroid(output: Triangles, heights: Sequence[Any]) -> Any:
    """Return the centre of gravity of triangles clipped at `heights` and joined by max.

    Exact. Between peaks k and k+1, with s from 0 to 1, the outline is
    max(min(p, 1−s), min(r, s)), where p and r are the two heights. Its area and first moment are
    those of both parts less those of their intersection min(p, r, s, 1−s), which is symmetric
    about one half.
    """
    area: Any = 0.0
    moment: Any = 0.0
    for k in range(len(heights) - 1):
        p, r = heights[k], heights[k + 1]
        if isinstance(p, float) and isinstance(r, float) and p == 0.0 and r == 0.0:
            continue
        z = minimum(minimum(p, r), 0.5)
        common = z * (1.0 - z)
        half_p, half_r = 0.5 * (p * p), 0.5 * (r * r)
        q = 1.0 - p
        a = p * q + half_p + r * (1.0 - r) + half_r - common
        m = (
            0.5 * (p * (q * q))
            + half_p * (1.0 - (2.0 / 3.0) * p)
            + 0.5 * (r * (1.0 - r * r))
            + (r * (r * r)) / 3.0
            - 0.5 * common
        )
        area = area + a
        moment = moment + (m + k * a)
    return output.low + output.width * (moment / area)


def sampled_centroid(output: Triangles, heights: Sequence[Any]) -> Any:
    """Return the centre of gravity from 101 equally spaced points of the universe."""
    sets, last = len(heights), SAMPLES - 1
    area: Any = 0.0
    moment: Any = 0.0
    for i in range(SAMPLES):
        k, rest = divmod(i * (sets - 1), last)
        s = rest / last
        degree = minimum(heights[k], 1.0 - s)
        if rest:
            degree = maximum(degree, minimum(heights[k + 1], s))
        area = area + degree
        moment = moment + degree * (output.low + (output.high - output.low) * i / last)
    return moment / area


@dataclass(frozen=True)
class Sugeno:
    """Zero-order Takagi-Sugeno inference of two inputs: the rules' numbers, weighted by degree.

    `rules[i][j]` is the number for row set i and column set j; the conjunction is "min" or
    "prod" (Simulink's default).
    """

    rows: Triangles
    columns: Triangles
    rules: tuple[tuple[float, ...], ...]
    conjunction: Literal["min", "prod"] = "min"

    def __post_init__(self) -> None:
        _check_rules(self.rules, self.rows, self.columns)
        if self.conjunction not in ("min", "prod"):
            raise ParameterError(f"conjunction is 'min' or 'prod', not {self.conjunction!r}")

    def __call__(self, row: Any, column: Any) -> Any:
        """Return the output for a value of each input."""
        r, c = self.rows.position(row), self.columns.position(column)
        if isinstance(r, float) and isinstance(c, float):
            i, r0, r1 = self.rows.active(r)
            j, c0, c1 = self.columns.active(c)
            row_degrees, column_degrees = ((i, r0), (i + 1, r1)), ((j, c0), (j + 1, c1))
        else:
            row_degrees = enumerate(self.rows.degrees(r))
            column_degrees = list(enumerate(self.columns.degrees(c)))
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
