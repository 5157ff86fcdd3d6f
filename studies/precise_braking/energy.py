"""Energy over running time: the study's table for one section, and for the seven runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...controllers.speed_curve import (
    Driving,
    SpeedCurve,
    fast_curve,
    minimum_energy_curve,
    timed_curve,
)
from ...models.line import Section, Train, beijing_line_5, metro_b
from ...models.line.beijing import SEVEN_RUNS

if TYPE_CHECKING:
    import pandas as pd

TIMES = (100.0, 105.0, 110.0, 120.0, 135.0)  # s, of the first run, 1544 m
SHARES = (1.05, 1.1, 1.2)  # of the fast curve's time, for all seven runs


@dataclass(frozen=True, kw_only=True, eq=False)
class EnergyPoint:
    """A section at one running time: the curve of the least energy, and two others.

    `fast` is the section's fast curve; `coasting`, with the same running time as `least`, only
    coasts from some place on.
    """

    section: Section
    fast: SpeedCurve
    coasting: SpeedCurve
    least: SpeedCurve

    @property
    def time(self) -> float:
        """The running time in s."""
        return self.least.running_time


def energy_points(
    section: Section, train: Train, times: Sequence[float], *, driving: Driving | None = None
) -> tuple[EnergyPoint, ...]:
    """Return the curves of a section for running times (s)."""
    fast = fast_curve(section, train, driving)
    return tuple(
        EnergyPoint(
            section=section,
            fast=fast,
            coasting=timed_curve(section, train, driving, time=time),
            least=minimum_energy_curve(section, train, driving, time=time),
        )
        for time in times
    )


def first_run() -> tuple[EnergyPoint, ...]:
    """Return the curves of Tiantongyuannan–Lishuiqiao, 1544 m, for `TIMES`."""
    return energy_points(beijing_line_5().section(*SEVEN_RUNS[0]), metro_b(), TIMES)


def seven_runs(shares: Sequence[float] = SHARES) -> tuple[EnergyPoint, ...]:
    """Return the curves of the seven runs for shares of their fast curves' times."""
    line, train = beijing_line_5(), metro_b()
    found: list[EnergyPoint] = []
    for start, end in SEVEN_RUNS:
        section = line.section(start, end)
        least = fast_curve(section, train).running_time
        found += energy_points(section, train, [share * least for share in shares])
    return tuple(found)


def energy_table(points: Sequence[EnergyPoint]) -> "pd.DataFrame":
    """Return a row for each point: times in s, energies at the wheel in kWh."""
    import pandas as pd

    return pd.DataFrame(
        {
            "section": p.section.name,
            "length": p.section.length,
            "fast_time": p.fast.running_time,
            "fast_energy": p.fast.kilowatt_hours,
            "time": p.time,
            "coasting_energy": p.coasting.kilowatt_hours,
            "least_energy": p.least.kilowatt_hours,
        }
        for p in points
    )
