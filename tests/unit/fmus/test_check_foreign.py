"""`check` on FMUs from elsewhere: honest ones pass, and each lie is told by its own rule."""

from pathlib import Path

import pytest

from railcosim.cli import main
from railcosim.fmus.check import check
from railcosim.fmus.check.report import Report, Verdict
from railcosim.fmus.info import describe
from tests.foreign import ALL, STATE, foreign_fmu
from tests.unit.cosim.test_fmu_block import rewrite
from tests.unit.fmus.test_check import failed

EXCHANGE = (*STATE, "providesDirectionalDerivative")


def without_verdict(report: Report) -> dict[str, str]:
    kinds = (Verdict.NOTHING, Verdict.UNCHECKED)
    return {f.rule: f.detail for f in report.findings if f.verdict in kinds}


def test_an_fmu_for_model_exchange_only(tmp_path: Path) -> None:
    path = foreign_fmu("thermostat", tmp_path)
    report = check(path)
    assert report.passed, str(report)
    assert str(report).splitlines()[0] == (
        "thermostat.fmu: FMI 2.0, model exchange, made by unknown tool"
    )
    assert str(report).endswith("passed; 1 could not be checked")
    assert without_verdict(report) == {
        "directional derivatives": "not declared (providesDirectionalDerivative)",
        "FMU state": "not declared (canGetAndSetFMUstate)",
        "serialized state": "not declared (canSerializeFMUstate)",
        "reference": "none given (--reference), and the FMU carries no equations",
    }
    same = next(f.detail for f in report.findings if f.rule == "states and derivatives")
    assert "10 of them after events" in same
    assert "1 continuous states, 1 event indicators" in describe(path)


def test_an_fmu_for_co_simulation_only_without_anything_optional(tmp_path: Path) -> None:
    report = check(foreign_fmu("filter", tmp_path))
    assert report.passed, str(report)
    assert without_verdict(report) == {
        "communication step": "not declared (canHandleVariableCommunicationStepSize)",
        "input derivatives": "not declared (canInterpolateInputs)",
        "output derivatives": "not declared (maxOutputDerivativeOrder)",
        "FMU state": "not declared (canGetAndSetFMUstate)",
        "serialized state": "not declared (canSerializeFMUstate)",
        "reference": "none given (--reference), and the FMU carries no equations",
    }


def test_a_coarse_but_honest_fmu_passes(tmp_path: Path) -> None:
    """Its results follow the communication step, and settle as that shrinks."""
    report = check(foreign_fmu("filter", tmp_path, declares=ALL, order=1))
    assert report.passed, str(report)
    detail = next(f.detail for f in report.findings if f.rule == "communication step")
    assert "a solver that follows the step" in detail
    assert without_verdict(report).keys() == {"reference"}


def test_an_honest_fmu_for_model_exchange_passes_with_all_it_declares(tmp_path: Path) -> None:
    report = check(foreign_fmu("thermostat", tmp_path, declares=EXCHANGE))
    assert report.passed, str(report)
    assert without_verdict(report).keys() == {"reference"}


@pytest.mark.parametrize(
    ("lie", "rule", "message"),
    [
        ("state", "FMU state", "b differs by up to"),
        ("serialized", "serialized state", "b differs"),
        ("state_of_rates", "input derivatives", "do not belong to the FMU state"),
        ("derivative", "initial derivatives", "∂flow/∂b is 0.5, by differences -0."),
        ("dependency", "initial dependencies", "flow depends on u, which is not listed"),
        ("interpolation", "input derivatives", "b has 1 of the error on a ramp that held"),
        ("slope", "output derivatives", "db/dt is 0, by differences"),
        ("step", "communication step", "smaller steps do not settle"),
        ("reset", "reset", "b differs by up to"),
        ("shared", "two instances", "first: b differs by up to"),
    ],
)
def test_lies_in_co_simulation(tmp_path: Path, lie: str, rule: str, message: str) -> None:
    found = failed(check(foreign_fmu("filter", tmp_path, declares=ALL, order=1, lie=lie)))
    assert message in found[rule]


@pytest.mark.parametrize(
    ("lie", "rule", "message"),
    [
        ("state", "FMU state", "x[0] differs by up to"),
        ("serialized", "serialized state", "x[0] differs"),
        ("derivative", "directional derivatives", "∂der(T)/∂T is -0.01001, by differences -0.01"),
        ("vector", "states and derivatives", "by fmi2GetDerivatives"),
        ("reset", "two instances, reset", "T differs by up to"),
    ],
)
def test_lies_in_model_exchange(tmp_path: Path, lie: str, rule: str, message: str) -> None:
    found = failed(check(foreign_fmu("thermostat", tmp_path, declares=EXCHANGE, lie=lie)))
    assert message in found[rule]


def test_a_dependency_that_is_not_listed_shows_on_the_way(tmp_path: Path) -> None:
    path = foreign_fmu("thermostat", tmp_path)
    lists = b'<Unknown index="6" dependencies="1 3"/>'
    fewer = b'<Unknown index="6" dependencies="1"/>'
    path = rewrite(path, tmp_path / "lie.fmu", lambda n, d: (n, d.replace(lists, fewer)))
    assert "flow depends on outside, which is not listed" in failed(check(path))["dependencies"]


def test_an_output_outside_its_own_bounds_is_a_warning(tmp_path: Path) -> None:
    report = check(foreign_fmu("filter", tmp_path, bounds='max="0.6"'))
    assert report.passed
    warning = next(f for f in report.findings if f.verdict is Verdict.WARNING)
    assert warning.rule == "bounds"
    assert "b runs from" in warning.detail
    assert "  warn  bounds" in str(report)


def test_an_fmu_that_crashes_is_told_with_what_was_found_before(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = foreign_fmu("filter", tmp_path, declares=ALL, order=1, lie="crash")
    assert main(["check", str(path)]) == 1
    text = " ".join(capsys.readouterr().out.split())
    assert "pass archive every file is whole" in text
    assert "FAIL crash" in text
    assert "the process that ran the FMU" in text
    assert "after 'communication step'" in text


def test_an_fmu_that_crashes_in_the_second_process_is_told(tmp_path: Path) -> None:
    path = foreign_fmu("filter", tmp_path, declares=ALL, order=1, lie="crash_elsewhere")
    assert "the second process" in failed(check(path))["serialized state"]
