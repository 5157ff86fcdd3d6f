"""Fuzzy control by a query table that was computed off line."""

from dataclasses import dataclass, field
from typing import Any

from ..base.errors import ParameterError
from ..base.ops import absolute, clip, finite, is_symbol, maximum, round_half_away, where
from ..cosim.block import Block, require, require_limits, require_positive
from .fuzzy.relation import LEVEL_DEFUZZIFIERS, LevelDefuzzifier, Relation, Table
from .fuzzy.tables import check_choice
from .stop_rules import STOP_RELATION

END = 6  # levels go from −6 to 6
E_LEVELS, EC_LEVELS = 2 * END + 2, 2 * END + 1


@dataclass(frozen=True, kw_only=True, slots=True)
class QueryTable(Block):
    """Table look-up control of a stop: U = table[E][EC], u = the middle of u_range + U/6 of half.

    Station-stop paper, sections 4.3 and 4.4. `error` e is in cm; EC = (e − last e)/period in
    cm/s, 0 at the first sample. `e_range` (cm) and `ec_range` (cm/s) are mapped to −6 … 6 (see
    `scaled`), clipped and rounded, halves away from zero; of what rounds to zero e ≥ 0 is +0 and
    e < 0 is −0. Outputs: `u` in cm, and the `level` U, no whole number where the defuzzifier
    gives none.

    - `table`: 14 rows (E = −6 … −0, +0 … 6) of 13 U (EC = −6 … 6). None: that of `relation` with
      `defuzzify`, "centroid" or "mean_of_maxima".
    - `on_line`: at each sample compose the levels with the relation, instead of looking up.
    - `interpolate` (ours): go between the table's cells by bilinear interpolation instead of
      rounding. At e = 0 stands the mean of the rows −0 and +0, so that u is continuous, and
      antisymmetric if the table is; those two rows themselves then appear nowhere.

    `ec_range` and the period are ours. Raise ParameterError for a range that is empty, a table
    of another size, or options that exclude each other.
    """

    relation: Relation = STOP_RELATION
    defuzzify: LevelDefuzzifier = "centroid"
    table: Table | None = None
    e_range: tuple[float, float] = (-10.0, 10.0)
    ec_range: tuple[float, float] = (-10.0, 10.0)
    u_range: tuple[float, float] = (0.0, 360.0)
    interpolate: bool = False
    on_line: bool = False
    period: float = 0.1
    _cells: Table = field(init=False, repr=False, compare=False)

    inputs = {"error": "cm"}
    outputs = {"u": "cm", "level": "1"}

    def __post_init__(self) -> None:
        for name in ("e_range", "ec_range", "u_range"):
            require_limits(self, name)
        require_positive(self, "period")
        check_choice("defuzzify", self.defuzzify, LEVEL_DEFUZZIFIERS)
        good = not (self.on_line and self.interpolate)
        require(self, good, "on_line inference knows no interpolation; choose one")
        good = not (self.on_line and self.table is not None)
        require(self, good, "on_line inference uses the relation; leave out the table")
        table = _off_line(self.relation, self.defuzzify) if self.table is None else self.table
        good = len(table) == E_LEVELS and all(len(row) == EC_LEVELS for row in table)
        require(self, good, f"the table must have {E_LEVELS} rows of {EC_LEVELS} numbers")
        good = all(finite(number) for row in table for number in row)
        require(self, good, "the table's numbers must be finite")
        object.__setattr__(self, "_cells", merged(table) if self.interpolate else table)

    def start(self) -> tuple[float, float]:
        """Return (last e, whether the next sample is the first and takes e for the last)."""
        return 0.0, 1.0

    def step(self, x: Any, error: Any) -> tuple[Any, Any]:
        """Return ((u, level), next state)."""
        last, first = x
        rate = (error - where(first > 0.5, error, last)) / self.period
        level = self._level(scaled(error, self.e_range), scaled(rate, self.ec_range))
        low, high = self.u_range
        u = 0.5 * (low + high) + (high - low) / (2.0 * END) * level
        return (u, level), (error, 0.0)

    def _level(self, e: Any, ec: Any) -> Any:
        if self.interpolate:
            return interpolated(self._cells, e + END, ec + END)
        magnitude = round_half_away(absolute(e))
        row = where(e >= 0.0, END + 1.0 + magnitude, END - magnitude)
        column = END + round_half_away(ec)
        if not self.on_line:
            return looked_up(self._cells, row, column)
        degrees = self.relation.compose(_one_hot(E_LEVELS, row), _one_hot(EC_LEVELS, column))
        return self.relation.defuzzify(degrees, self.defuzzify)


def scaled(value: Any, limits: tuple[float, float]) -> Any:
    """Return X = (d − c)/(b − a) (value − (a + b)/2) for [a, b] mapped to [c, d] = [−6, 6].

    The paper's section 4.3, whose formula is lost; the usual one. What lies outside is clipped.
    """
    low, high = limits
    return clip(2.0 * END / (high - low) * (value - 0.5 * (low + high)), -float(END), float(END))


def looked_up(cells: Table, row: Any, column: Any) -> Any:
    """Return the cell at a row and column, which are whole numbers from 0.

    On symbols sums in which all terms but one are 0, so exact.
    """
    if not is_symbol(row) and not is_symbol(column):
        return cells[int(row)][int(column)]
    columns, total = [column == j for j in range(len(cells[0]))], 0.0
    for i, numbers in enumerate(cells):
        cell: Any = 0.0
        for here, number in zip(columns, numbers, strict=True):
            cell = cell + where(here, number, 0.0)
        total = total + where(row == i, cell, 0.0)
    return total


def interpolated(cells: Table, row: Any, column: Any) -> Any:
    """Return the bilinear interpolation between cells; the place is no whole number here."""
    rows, columns = _hats(len(cells), row), _hats(len(cells[0]), column)
    total: Any = 0.0
    for i, a in rows:
        part: Any = 0.0
        for j, b in columns:
            part = part + b * cells[i][j]
        total = total + a * part
    return total


def _hats(count: int, place: Any) -> list[tuple[int, Any]]:
    """Return (k, weight) of the neighbours of a place: on floats two, on symbols all."""
    if is_symbol(place):
        return [(k, maximum(0.0, 1.0 - absolute(place - k))) for k in range(count)]
    k = min(int(place), count - 2)
    return [(i, 1.0 - abs(place - i)) for i in (k, k + 1)]


def _one_hot(count: int, place: Any) -> list[Any]:
    return [where(place == k, 1.0, 0.0) for k in range(count)]


def merged(table: Table) -> Table:
    """Return the 13 rows between which to interpolate: −0 and +0 are one place, e = 0."""
    zero = tuple(0.5 * (a + b) for a, b in zip(table[END], table[END + 1], strict=True))
    return (*table[:END], zero, *table[END + 2 :])


def _off_line(relation: Relation, defuzzify: LevelDefuzzifier) -> Table:
    sizes = len(relation.rows.names), len(relation.columns.names)
    if sizes != (E_LEVELS, EC_LEVELS):
        raise ParameterError(
            f"QueryTable: the relation's inputs must have {E_LEVELS} and {EC_LEVELS} levels, "
            f"not {sizes[0]} and {sizes[1]}"
        )
    return relation.table(defuzzify)
