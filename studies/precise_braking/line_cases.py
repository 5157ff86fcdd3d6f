"""Whole runs and their energies as cases: for the paper's runs, and for any line."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from ...controllers.speed_curve import SpeedCurve, fast_curve
from ...cosim import Run
from ...models.line import Section, Train, beijing_line_5, metro_b
from ...models.line.beijing import SEVEN_RUNS
from ..case import Case
from ..computed import Computed, Rows
from ..metrics import Metrics
from .controllers import maker
from .energy import EnergyPoint, energy_points, first_run, seven_runs
from .line_run import LineRun, judged, line_run
from .stations import STATIONS
from .stopping import stop_case
from .stops import TRAINS, predictive
from .truth import PLATFORM, Truth

SHARE = 1.1  # of the fast curve's time, for the energies of all runs
SHARES = (1.05, 1.1, 1.2)  # of a user's line
RECORD = (
    "train.position", "train.speed", "train.acceleration", "train.traction_energy",
    "train.phase", "ato.command", "atp.limit", "atp.warning", "atp.emergency",
)  # fmt: skip

_first_run = cache(first_run)


def cases() -> list[Case]:
    """Return the energies of the first run and of all, and whole runs."""
    line, train = beijing_line_5(), metro_b()
    found: list[Case] = [
        Computed.of("energy", lambda: _rows(_first_run())),
        Computed.of("energy_of_runs", _all_runs),
    ]
    for (start, end), station in zip(SEVEN_RUNS, STATIONS, strict=True):
        section = line.section(start, end)
        curves = {"fast": fast_curve(section, train)}
        if station is STATIONS[0]:
            curves |= {f"time_{point.time:.0f}": point.least for point in _first_run()}
        found += _runs(f"run_{station.key}", section, train, curves)
    return found


def _all_runs() -> Rows:
    points = seven_runs((SHARE,))
    rows = (_row(point) for point in points)
    return {s.key: (row, None) for s, row in zip(STATIONS, rows, strict=True)}


def on_line(section: Section, train: Train) -> list[Case]:
    """Return the energies and whole runs of one section, and the stops at its end."""
    fast = fast_curve(section, train)
    times = [share * fast.running_time for share in SHARES]
    points = energy_points(section, train, times)
    curves = {"fast": fast, **{f"time_{point.time:.0f}": point.least for point in points}}
    known = _at_the_end(section)
    return [
        Computed.of("energy", lambda: _rows(points)),
        *_runs("run", section, train, curves),
        stop_case("stop", "smarc_dob_m2", maker("smarc_dob_m2")(known), known),
        stop_case("stop", "predictive_v6", predictive(known), known),
    ]


def _runs(
    experiment: str, section: Section, train: Train, curves: Mapping[str, SpeedCurve]
) -> list[Case]:
    """Return runs of the FMU along curves, under ATO with ATP watching."""
    return [
        _case(experiment, name, line_run(section, train, curve)) for name, curve in curves.items()
    ]


def _case(experiment: str, name: str, way: LineRun) -> Case:
    def measure(run: Run) -> Metrics:
        return dict(judged(way, run))

    return Case(experiment, name, way.diagram, way.stop, measure, record=RECORD)


def _rows(points: Sequence[EnergyPoint]) -> Rows:
    """Return a row for each running time; the trace is the curve every 0.1 s."""
    return {f"time_{point.time:.0f}": (_row(point), _trace(point.least)) for point in points}


def _row(point: EnergyPoint) -> Metrics:
    return {
        "running_time": point.time,
        "planned_energy": point.least.kilowatt_hours,
        "coasting_energy": point.coasting.kilowatt_hours,
        "fast_energy": point.fast.kilowatt_hours,
        "max_jerk": float(np.abs(point.least.jerk).max()),
    }


def _trace(curve: SpeedCurve) -> Run:
    at = curve.at(np.arange(0.0, curve.running_time + 0.1, 0.1))
    units = {"curve.position": "m", "curve.speed": "m/s", "curve.acceleration": "m/s2"}
    values = np.column_stack([at.position, at.speed, at.acceleration])
    return Run("curve", at.time, values, tuple(units), units)


def _at_the_end(section: Section) -> Truth:
    """Return a nominal train before a section's stop, with the gradients that are there.

    Those of the platform and of the braking before it, each the mean over its stretch.
    """

    def mean(begin: float, end: float) -> float:
        rise = section.elevation(section.length - end) - section.elevation(section.length - begin)
        return 1000.0 * rise / (begin - end)

    return replace(
        TRAINS["v6"], approach=mean(PLATFORM + 120.0, PLATFORM), platform=mean(PLATFORM, 0.0)
    )
