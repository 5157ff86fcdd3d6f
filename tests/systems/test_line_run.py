"""Whole runs of the metro train's FMU, departure to stop, under ATO with ATP watching."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim import Override, Run, Scenario
from railcosim.base.errors import ParameterError
from railcosim.models.line import SEVEN_RUNS, beijing_line_5, metro_b
from railcosim.studies.precise_braking.line_run import LEAD, OVERLAP, LineRun, judged, line_run
from railcosim.studies.precise_braking.truth import V6, V12, Truth

TRAIN = metro_b()
FIRST = beijing_line_5().section(*SEVEN_RUNS[0])


def run_of(plan: float | str, *, truth: Truth = V12, number: int = 0) -> tuple[LineRun, Run]:
    section = beijing_line_5().section(*SEVEN_RUNS[number])
    drive = line_run(section, TRAIN, plan, truth=truth)
    return drive, drive.diagram.run(drive.stop)


def arrives(drive: LineRun, run: Run) -> dict[str, float]:
    found = judged(drive, run)
    assert abs(found["late"]) < 1.0, found
    assert abs(found["stop_error"]) < 30.0, found
    assert found["warning"] == found["emergency"] == 0.0
    assert found["overspeed"] < 0.1
    assert found["max_jerk"] < 0.7
    assert found["energy"] == pytest.approx(found["planned_energy"], rel=0.01)
    return found


@pytest.mark.parametrize(
    ("plan", "truth", "number"), [("fast", V12, 0), (110.0, V12, 0), ("fast", V6, 3)]
)
def test_it_arrives(plan: float | str, truth: Truth, number: int) -> None:
    """Within 1 s and 30 cm, with the energy of the plan, and without the ATP."""
    drive, run = run_of(plan, truth=truth, number=number)
    arrives(drive, run)
    # On the way it keeps to the curve.
    at = drive.curve.at(np.asarray(run.frame.index) - LEAD)
    assert np.abs(run["train.position"] - at.position).max() < 0.5
    assert np.abs(run["train.speed"] - at.speed).max() < 0.25


@pytest.mark.slow
def test_all_seven_runs_arrive() -> None:
    for number in range(len(SEVEN_RUNS)):
        for share in (None, 1.1):
            drive, run = run_of("fast", number=number)
            if share is not None:
                drive, run = run_of(share * drive.curve.running_time, number=number)
            arrives(drive, run)


def test_rotating_masses_are_those_of_the_plan() -> None:
    drive = line_run(FIRST, replace(TRAIN, rotating_mass_factor=1.1))
    arrives(drive, drive.diagram.run(drive.stop))


def test_a_slope_that_the_brakes_do_not_hold() -> None:
    steep = replace(FIRST, gradients=((0.0, 0.0), (1000.0, -30.0)))
    with pytest.raises(ParameterError, match=r"of the brakes, which give 0\.85 m/s²; it is too st"):
        line_run(steep, TRAIN)


@pytest.mark.parametrize("at", [20.0, 94.0])
def test_full_traction_that_no_curve_asked_for_is_caught(at: float) -> None:
    drive = line_run(FIRST, TRAIN)
    full = Scenario([Override("ato.command", 1.5, at=at)])
    run = drive.diagram.run(150.0, scenario=full)
    assert run["atp.emergency"].max() == 1.0
    assert run["atp.margin"].min() >= 0.0
    assert run["train.speed"][-1] == 0.0
    assert run["train.position"][-1] < FIRST.length + OVERLAP


def test_a_plan_that_is_none() -> None:
    with pytest.raises(ParameterError, match="no plan 'quick'"):
        line_run(FIRST, TRAIN, "quick")
