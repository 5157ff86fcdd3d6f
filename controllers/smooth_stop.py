"""A quieter use of the query table: interpolated, on universes that grow with the speed."""

from dataclasses import dataclass, field
from typing import Any

from ..base.ops import where
from ..cosim.block import Block, require, require_finite, require_limits, require_positive
from .fuzzy.relation import LEVEL_DEFUZZIFIERS, LevelDefuzzifier, Table
from .fuzzy.tables import check_choice
from .query_table import END, interpolated, merged, scaled
from .stop_rules import STOP_RELATION


@dataclass(frozen=True, kw_only=True, slots=True)
class SmoothStop(Block):
    """u from the station-stop paper's rules, interpolated; not in the paper, our choice.

    Far from the mark a small change of the brake moves the predicted stop by far more than
    the table's ±10 cm, and its rate by more than ±10 cm/s: the table then only swings between its
    ends. Here the universes widen with the speed v (m/s), E to ±(e_range + e_growth · v) cm and
    EC to ±(ec_range + ec_growth · v) cm/s, so that the same error means less far away. Between
    the cells the table is interpolated as by `QueryTable(interpolate=True)`. `error` is in cm;
    outputs `u` in cm, and the `level` in −6 … 6.

    Raise ParameterError for ranges that are not positive or that shrink with the speed.
    """

    defuzzify: LevelDefuzzifier = "mean_of_maxima"
    e_range: float = 10.0
    e_growth: float = 5.0
    ec_range: float = 10.0
    ec_growth: float = 50.0
    u_range: tuple[float, float] = (0.0, 360.0)
    period: float = 0.1
    _cells: Table = field(init=False, repr=False, compare=False)

    inputs = {"error": "cm", "speed": "m/s"}
    outputs = {"u": "cm", "level": "1"}

    def __post_init__(self) -> None:
        require_positive(self, "e_range", "ec_range", "period")
        require_finite(self, "e_growth", "ec_growth")
        for name in ("e_growth", "ec_growth"):
            value = getattr(self, name)
            require(self, value >= 0.0, f"{name} must not be negative, is {value!r}")
        require_limits(self, "u_range")
        check_choice("defuzzify", self.defuzzify, LEVEL_DEFUZZIFIERS)
        object.__setattr__(self, "_cells", merged(STOP_RELATION.table(self.defuzzify)))

    def start(self) -> tuple[float, float]:
        """Return (last error, whether the next sample is the first and takes it for the last)."""
        return 0.0, 1.0

    def step(self, x: Any, error: Any, speed: Any) -> tuple[Any, Any]:
        """Return ((u, level), next state)."""
        last, first = x
        rate = (error - where(first > 0.5, error, last)) / self.period
        moving = where(speed > 0.0, speed, 0.0)
        e = self.e_range + self.e_growth * moving
        ec = self.ec_range + self.ec_growth * moving
        level = interpolated(
            self._cells, scaled(error, (-e, e)) + END, scaled(rate, (-ec, ec)) + END
        )
        low, high = self.u_range
        u = 0.5 * (low + high) + (high - low) / (2.0 * END) * level
        return (u, level), (error, 0.0)
