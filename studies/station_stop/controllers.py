"""The controllers that the study compares, by the names used in its results."""

from dataclasses import dataclass
from typing import Any

from ...controllers import QueryTable, SmoothStop
from ...cosim import Block

PERIOD = 0.1  # s, of the main case; ours
RAW_PERIOD = 0.05  # s, of the raw-error case; ours


@dataclass(frozen=True, kw_only=True, slots=True)
class OpenLoop(Block):
    """The table's middle, whatever the error: a driver who brakes by estimate and lets it be."""

    period: float = PERIOD

    outputs = {"u": "cm", "level": "1"}

    def step(self, x: Any) -> tuple[Any, Any]:
        """Return ((180 cm, 0), no state)."""
        return (180.0, 0.0), x


LINE_UP: dict[str, Block] = {
    "open_loop": OpenLoop(),
    "centroid": QueryTable(period=PERIOD),
    "centroid_on_line": QueryTable(on_line=True, period=PERIOD),
    "centroid_ec20": QueryTable(ec_range=(-20.0, 20.0), period=PERIOD),
    "mean_of_maxima": QueryTable(defuzzify="mean_of_maxima", period=PERIOD),
    "smooth": SmoothStop(period=PERIOD),
}
RAW: dict[str, Block] = {
    "centroid": QueryTable(ec_range=(-30.0, 30.0), period=RAW_PERIOD),
    "mean_of_maxima": QueryTable(
        defuzzify="mean_of_maxima", ec_range=(-30.0, 30.0), period=RAW_PERIOD
    ),
}
