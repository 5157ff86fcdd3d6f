"""Whole runs and their energies as cases: for the paper's runs, and for any line."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from ...controllers.speed_curve import SpeedCurve, fast_curve
from ...cosim import Run
from ...models.line import Section, Train, beijing_line_5, metro_b
from ...models.line.beijing import SEVEN_RUNS
from ..case import Case
from ..computed import Computed, Rows
from ..metrics import Metrics
from ..results import Results
from .energy import EnergyPoint, energy_points, first_run, seven_runs
from .line_run import LineRun, judged, line_run
from .stations import STATIONS

SHARE = 1.1  # of the fast curve's time, for the energies of all runs
SHARES = (1.05, 1.1, 1.2)  # of a user's line
MISS, LATE = 30.0, 1.0  # cm, s: what a run may be off its plan
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
        curve = fast_curve(section, train)
        found.append(_case(f"run_{station.key}", "fast", line_run(section, train, curve)))
    return [*found, Computed.of("run_saving", _driven)]


def _all_runs() -> Rows:
    points = seven_runs((SHARE,))
    rows = (_row(point) for point in points)
    return {s.key: (row, None) for s, row in zip(STATIONS, rows, strict=True)}


def _driven() -> Rows:
    """Return the first run along its curves of the least energy, driven by the FMU."""
    line, train = beijing_line_5(), metro_b()
    section = line.section(*SEVEN_RUNS[0])
    found = {}
    for point in _first_run():
        way = line_run(section, train, point.least)
        run = way.diagram.run(way.stop, record=RECORD, progress=False)
        found[f"time_{point.time:.0f}"] = (dict(judged(way, run)), run)
    return found


def on_line(section: Section, train: Train) -> list[Case]:
    """Return the energies and whole runs of one section, which may be any."""
    fast = fast_curve(section, train)
    points = energy_points(section, train, [share * fast.running_time for share in SHARES])
    curves = {"fast": fast, **{f"time_{point.time:.0f}": point.least for point in points}}
    return [
        Computed.of("energy", lambda: _rows(points)),
        *(_case("run", name, line_run(section, train, curve)) for name, curve in curves.items()),
    ]


def unmet(results: Results) -> list[str]:
    """Return, in words, which runs on a line did not go as planned."""
    return [
        f"the run '{name}' stopped {row['stop_error'] or 0.0:.0f} cm past the mark, "
        f"{row['late'] or 0.0:.1f} s late{', braked by the ATP' if row['emergency'] else ''}"
        for name, row in results.metrics.get("run", {}).items()
        if not _went_well(row)
    ]


def _went_well(row: Metrics) -> bool:
    error, late = row["stop_error"], row["late"]
    arrived = error is not None and abs(error) <= MISS and late is not None and abs(late) <= LATE
    return arrived and not row["emergency"]


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
