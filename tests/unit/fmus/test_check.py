"""`check` on FMUs of ours: all that they declare works, and the report says so."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from railcosim.base.errors import FmuError
from railcosim.fmus import build
from railcosim.fmus.check import check
from railcosim.fmus.check.report import Report, Verdict
from railcosim.models import Plant, second_order_train
from railcosim.models.solver import DormandPrince, Rodas, RungeKutta4, SemiImplicitEuler
from tests import hybrid_plants, plants

BOTH = ("co-simulation", "model exchange")


@cache
def checked(plant: Callable[[], Plant]) -> Report:
    """Return the report of a plant's FMU, which several tests look at."""
    return check(build(plant()))


def failed(report: Report) -> dict[str, str]:
    return {f.rule: f.detail for f in report.findings if f.passed is False}


def details(report: Report, part: str) -> dict[str, str]:
    return {f.rule: f.detail for f in report.findings if f.part == part}


@pytest.mark.parametrize(
    "plant",
    [
        second_order_train,
        plants.everything,
        plants.pendulum,
        lambda: plants.passing("passing"),
        hybrid_plants.geared,
    ],
)
def test_our_fmus_pass(plant) -> None:
    report = checked(plant)
    assert report.passed, str(report)
    assert not report.unchecked, str(report)
    assert report.comparisons
    assert all(c.error < 1e-9 for c in report.comparisons)


@pytest.mark.parametrize(
    "plant",
    [
        hybrid_plants.braking,
        hybrid_plants.ball,
        hybrid_plants.stick_slip,
        hybrid_plants.clock,
        hybrid_plants.fleet,
    ],
)
def test_our_hybrid_fmus_pass(plant) -> None:
    report = checked(plant)
    assert report.passed, str(report)
    assert not report.unchecked, str(report)
    assert not report.comparisons  # the equations do not tell what happens at events
    assert "stand for it" in details(report, "reference")["reference"]
    for part in BOTH:
        assert "are what the equations give" in details(report, part)["equations"]


@pytest.mark.parametrize("solver", [DormandPrince(), Rodas(), SemiImplicitEuler(positions=("x",))])
def test_every_solver_keeps_its_state(solver) -> None:
    """Whatever a solver remembers from step to step belongs to the FMU's state."""
    plant = plants.integrator() if isinstance(solver, SemiImplicitEuler) else plants.pendulum()
    report = check(build(plant, solver=solver), tolerance=1e-3)
    assert report.passed, str(report)
    assert not report.unchecked, str(report)


def test_states_of_a_hybrid_plant_go_on_in_another_process_at_50_random_times() -> None:
    report = checked(hybrid_plants.braking)
    assert report.passed, str(report)
    found = details(report, "co-simulation")
    text = (
        r"states at 50 random points and \d+ beside events, half between set and step, 1\d of them"
    )
    assert re.match(text + " after an error: goes on to the same bits", found["FMU state"])
    assert re.match(r"5\d states of \d+ bytes", found["serialized state"])
    assert "go on in a second process to the same bits" in found["serialized state"]
    found = details(report, "model exchange")
    assert "of them after events: goes on to the same bits" in found["FMU state"]
    assert re.match(r"2\d states go on in a second process", found["serialized state"])


def test_every_capability_has_a_verdict() -> None:
    report = checked(second_order_train)
    rules = {
        part: {f.rule for f in report.findings if f.part == part and f.passed} for part in BOTH
    }
    common = {
        "GUID", "log categories", "initial values", "initial dependencies", "initial derivatives",
        "runs", "FMU state", "serialized state", "equations",
    }  # fmt: skip
    assert rules["co-simulation"] == common | {
        "two instances", "threads", "reset", "communication step", "input derivatives",
        "output derivatives",
    }  # fmt: skip
    assert rules["model exchange"] == common | {
        "against co-simulation", "nominal values", "two instances, reset",
        "states and derivatives", "dependencies", "directional derivatives",
    }  # fmt: skip


def test_the_reference_is_what_fits_the_equations() -> None:
    assert "the matrix exponential" in checked(second_order_train).reference
    assert "DOP853" in checked(plants.pendulum).reference


def test_a_solver_that_is_too_coarse_is_told() -> None:
    path = build(plants.pendulum(), solver=RungeKutta4(inner_step=0.1))
    report = check(path, step=0.1)
    assert not report.passed
    assert any(not c.passed for c in report.comparisons)
    against = next(f for f in report.findings if f.rule == "against co-simulation")
    assert against.verdict is Verdict.UNCHECKED
    assert "a coarse solver in the FMU would explain it" in against.detail
    assert check(path, step=0.1, tolerance=0.01).passed


def test_constant_pieces_are_not_taken_for_linear() -> None:
    report = check(build(plants.switching()))
    assert report.passed, str(report)
    assert "DOP853" in report.reference


def test_a_signal_at_rest_passes() -> None:
    report = check(build(plants.resting()))
    assert report.passed, str(report)


def test_an_fmu_that_fails_to_run_is_told(tmp_path: Path) -> None:
    report = check(build(plants.blow_up()), stop=2.0)
    assert not report.passed
    for part in BOTH:
        runs = next(f for f in report.findings if f.rule == "runs" and f.part == part)
        assert runs.passed is not True
    assert "x is not finite" in details(report, "co-simulation")["runs"]


def test_what_cannot_be_read_at_all_is_an_error(tmp_path: Path, train_fmu: Path) -> None:
    with pytest.raises(FmuError, match="no file"):
        check(tmp_path / "none.fmu")
    with pytest.raises(FmuError, match="step must be a positive"):
        check(train_fmu, step=0.0)
    with pytest.raises(FmuError, match="tolerance must be positive"):
        check(train_fmu, tolerance=0.0)


def test_the_report_is_a_table() -> None:
    lines = str(checked(second_order_train)).splitlines()
    assert lines[0].startswith(
        "second_order_train.fmu: FMI 2.0, co-simulation and model exchange, made by railcosim"
    )
    assert lines[-1] == "passed"
    assert max(map(len, lines)) <= 100
    head = next(line for line in lines if "max error" in line)
    assert head.split() == ["variable", "unit", "max", "error", "at", "t", "/", "s", "tolerance"]
    for part in ("the file", *BOTH):
        assert f"  {part}" in lines


def test_the_report_counts_what_failed_and_what_could_not_be_checked() -> None:
    report = Report("x.fmu", part="the file")
    report.add("one", [], "good")
    report.add("two", [f"problem {i}" for i in range(5)], "")
    report.skip("three", "no reason")
    report.nothing("four", "nothing there")
    report.warn("five", ["odd"], "")
    text = str(report)
    assert text.endswith("1 of 5 checks failed; 1 could not be checked")
    assert "problem 2; and 2 more" in text
    assert "  warn  five   odd" in text
    assert not report.passed
