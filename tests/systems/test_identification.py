"""Identification from the logs of the whole loop: FMU, delays, train control, noise, spread."""

import numpy as np
import pytest

from railcosim.studies.identification.braking import brakings
from railcosim.studies.identification.fit import fit
from railcosim.studies.identification.precise_model import PreciseModel
from railcosim.studies.precise_braking.identify import (
    Fidelity,
    command_loop,
    computing_time,
    fidelity,
    target,
)
from railcosim.studies.precise_braking.logs import SyntheticLog, synthetic_log, synthetic_logs
from railcosim.studies.precise_braking.truth import V12, Truth


@pytest.fixture(scope="module")
def logs() -> tuple[SyntheticLog, ...]:
    return synthetic_logs()


@pytest.fixture(scope="module")
def found(logs: tuple[SyntheticLog, ...]) -> Fidelity:
    return fidelity(logs)


def test_the_model_is_the_fmus_loop() -> None:
    """Second order in the step; the FMU's own error is 1e-11 (docs/plants.md)."""
    truth = Truth(electric_delay=0.913, air_delay=0.764, approach=2.0, platform=2.0)
    made = synthetic_log(truth, name="exact", seed=1, noise=0.0)
    (braking,) = brakings([made.log])
    stop = made.log.time[np.argmax(made.log.speed <= 0.1)]
    onset = made.run["train.changeover_time"][-1] + truth.air_delay - (stop - braking.time[-1])
    object.__setattr__(braking, "onset", float(onset))
    free = [0.913, truth.electric_lag, truth.electric_coefficient, 0.764, truth.air_lag,
            truth.air_gain]  # fmt: skip
    for step, largest in ((0.1, 5e-4), (0.05, 1e-4)):
        assert np.max(np.abs(PreciseModel([braking], step=step).errors(np.array(free)))) < largest


def test_precise_against_coarse(found: Fidelity) -> None:
    assert 18.0 < found.rmse["precise"] < 26.0
    assert 94.0 < found.rmse["coarse"] < 150.0
    assert found.rmse["precise"] < 0.6 * found.rmse["coarse_fitted"]
    assert np.all(found.by_log["precise"].to_numpy() < found.by_log["coarse"].to_numpy())
    assert len(found.by_log) == 16
    for name in ("precise", "coarse"):
        assert found.slow[name] > found.fast[name]


def test_finds_what_the_trains_have(found: Fidelity, logs: tuple[SyntheticLog, ...]) -> None:
    report, wanted = found.report, target(logs)
    assert report.precise is not None
    assert report.delays is not None
    values, errors = report.precise.values, {}
    errors = {e.parameter.name: e.standard_error for e in report.estimates}
    assert report.precise.evaluations <= 200
    for coefficient in (wanted.coefficient, V12.electric_coefficient):
        assert values["electric_coefficient"] == pytest.approx(coefficient, rel=0.01)
    for delays in (wanted.delays, V12.electric_delay + V12.electric_lag):
        assert report.delays[0] == pytest.approx(delays, abs=0.05)
    for name, value in (
        ("electric_delay", wanted.electric_delay), ("electric_lag", wanted.electric_lag),
        ("air_delay", wanted.air_delay), ("air_lag", wanted.air_lag), ("air_gain", wanted.gain),
    ):  # fmt: skip
        error = errors[name]
        assert error is not None
        assert abs(values[name] - value) < 4.0 * error
    assert report.precise.runs is not None
    assert report.precise.runs.noise == pytest.approx(0.03, rel=0.05)


def test_says_what_is_not_identifiable(found: Fidelity) -> None:
    report = found.report
    assert report.separate is not None
    assert report.uncertainty is not None
    assert report.separate.lost() in (["K1 + K2"], ["K2 + K1"])
    assert report.separate.singular_values[-1] < 1e-12 * report.separate.singular_values[0]
    pairs = {pair[:2]: pair[2] for pair in report.uncertainty.correlated()}
    assert pairs["T4", "K"] > 0.95
    text = str(report)
    assert "K1 and K2 separately" in text
    assert "T4 and K hardly apart" in text
    assert "25.8" in text


def test_least_squares_has_the_least_error_but_not_the_truth(
    found: Fidelity, logs: tuple[SyntheticLog, ...]
) -> None:
    model = PreciseModel(brakings([m.log for m in logs]), step=0.2)
    least = fit(model, method="least_squares")
    assert report_rmse(found) > least.rmse > 18.0
    assert least.evaluations <= 200


def report_rmse(found: Fidelity) -> float:
    assert found.report.precise is not None
    return found.report.precise.rmse


def test_fitted_models_as_fmus(found: Fidelity) -> None:
    """The same speeds as the models alone, until the platform's gradient; and times to compare."""
    assert found.report.published is not None
    braking = found.report.best.model.brakings[0]
    loop = command_loop(found.report.published, braking)
    run = loop.run(6.0, record=["train.speed"], progress=False)
    alone = found.report.published.model.trajectory(found.report.published.free, 0)
    assert run["train.speed"][::20] == pytest.approx(alone[:31], abs=1e-4)
    times = computing_time(found.report, repeats=4)
    assert min(times.precise, times.coarse, times.precise_loop, times.coarse_loop) > 0.0
