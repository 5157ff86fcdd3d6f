"""The models over logs against scipy, and their derivatives against differences."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from railcosim.studies.identification.braking import Braking, brakings
from railcosim.studies.identification.coarse_model import CoarseModel
from railcosim.studies.identification.fit import fit
from railcosim.studies.identification.precise_model import PreciseModel
from tests.unit.studies.identification.reference_train import Train, log

TRAIN = Train(T1=0.87, T2=0.8, P1=0.86, T3=0.73, T4=1.6, K=0.84, slope=3.0)
TRUE = np.array([0.87, 0.8, 0.86, 0.73, 1.6, 0.84])


@pytest.fixture(scope="module")
def exact() -> list[Braking]:
    """Brakings without noise, whose air brake's onset is known exactly."""
    found = []
    for kind in range(3):
        made, onset = log(TRAIN, kind)
        (braking,) = brakings([made])
        begin = made.time[np.argmax(made.speed <= 0.1)] - braking.time[-1]
        found.append(replace(braking, onset=onset - begin))
    return found


def test_runs_as_scipy_does_and_converges(exact: list[Braking]) -> None:
    largest = {
        step: np.max(np.abs(PreciseModel(exact, step=step).errors(TRUE)))
        for step in (0.2, 0.1, 0.05, 0.025)
    }
    assert largest[0.2] < 2e-3
    assert largest[0.1] < 5e-4
    assert largest[0.05] < 1e-4
    assert largest[0.025] < 0.1 * largest[0.2]


def test_a_heavier_train_and_weaker_brakes_are_the_same(exact: list[Braking]) -> None:
    heavy = PreciseModel(exact, fixed={"mass_ratio": 1.1})
    wanted = PreciseModel(exact).speeds(TRUE)
    assert heavy.speeds(TRUE * [1, 1, 1.1, 1, 1, 1.1]) == pytest.approx(wanted, abs=1e-10)


@pytest.mark.parametrize("flag", [True, False])
def test_sensitivities_are_differences(exact: list[Braking], flag: bool) -> None:
    found = exact if flag else [replace(b, onset=None) for b in exact]
    model = PreciseModel(found)
    free = TRUE if flag else np.append(TRUE, TRAIN.V_sw)
    # Not on a kink: no delayed edge meets a step's end.
    free = free + 0.003
    _, jacobian = model.errors_and_jacobian(free)
    for i, parameter in enumerate(model.free):
        moved = np.zeros(len(free))
        moved[i] = 1e-5
        difference = (model.errors(free + moved) - model.errors(free - moved)) / 2e-5
        # The slope of the measured speed, and so that of V_sw, is taken over a second.
        tolerance = 0.1 if parameter.symbol == "V_sw" else 1e-5
        scale = np.max(np.abs(difference))
        assert jacobian[:, i] == pytest.approx(difference, abs=tolerance * scale), parameter.symbol


def test_sensitivities_of_the_coarse_model(exact: list[Braking]) -> None:
    model = CoarseModel(exact)
    free = np.array([0.313, 0.65])
    _, jacobian = model.errors_and_jacobian(free)
    for i in range(2):
        moved = 1e-5 * np.eye(2)[i]
        difference = (model.errors(free + moved) - model.errors(free - moved)) / 2e-5
        assert jacobian[:, i] == pytest.approx(difference, abs=1e-5 * np.max(np.abs(difference)))


def test_a_delay_acts_smoothly(exact: list[Braking]) -> None:
    """No staircase: a thousandth of a step more delay moves the speeds by about as little."""
    model = PreciseModel(exact, step=0.1)
    speeds = [model.speeds(TRUE + d * np.eye(6)[0]) for d in np.linspace(0.0, 0.2, 41)]
    moves = [np.max(np.abs(b - a)) for a, b in pairwise(speeds)]
    assert max(moves) < 1.5 * min(moves)


def test_finds_the_parameters_of_logs_without_noise(exact: list[Braking]) -> None:
    found = fit(PreciseModel(exact, step=0.05), method="least_squares")
    assert found.free == pytest.approx(TRUE, rel=5e-3)
    assert found.free[:3] == pytest.approx(TRUE[:3], rel=5e-4)
    assert found.rmse < 0.01
    assert found.evaluations <= 100


def test_finds_them_without_a_flag_too(exact: list[Braking]) -> None:
    """The instant of V_sw comes from the measured speed, which leaves some milliseconds open."""
    plain = [replace(b, onset=None) for b in exact]
    known = PreciseModel(plain, step=0.05, fixed={"changeover_speed": TRAIN.V_sw})
    found = fit(known, method="least_squares")
    assert found.free == pytest.approx(TRUE, rel=0.03)
    assert found.free[:3] == pytest.approx(TRUE[:3], rel=2e-3)


def test_each_braking_may_have_parameters_of_its_own(exact: list[Braking]) -> None:
    model = PreciseModel(exact)
    rows = np.array([TRUE, TRUE * 1.05, TRUE * 0.95])
    together = model.speeds(rows)
    for i, row in enumerate(rows):
        alone = PreciseModel(exact[i : i + 1]).speeds(row)
        assert together[model.log_of_sample == i] == pytest.approx(alone, abs=1e-9)


def test_unevenly_spaced_samples(exact: list[Braking]) -> None:
    """Leaving out samples of the speed, but no command, leaves the model's speeds as they are."""
    braking = exact[0]
    order = np.random.default_rng(3).permutation(len(braking.time) - 1)
    kept = np.append(0, np.sort(order[:80]) + 1)
    columns = {n: getattr(braking, n)[kept] for n in ("time", "speed", "gradient", "counts")}
    thin = replace(braking, **columns)
    assert np.max(np.abs(PreciseModel([thin], step=0.05).errors(TRUE))) < 2e-4
