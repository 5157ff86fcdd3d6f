"""The estimate: recovers what is true, and agrees with scipy's least squares."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from railcosim.base.errors import ParameterError
from railcosim.controllers.predictive_stop import PARAMETERS, BrakingModel, Prior, Samples
from tests.braking_reference import Reference

PRIOR = Prior.nominal(changeover_speed=6.0 / 3.6, fade_rate=0.60, approach=2.0, platform=-1.0)
MODEL = BrakingModel()
COMMANDS = (
    *[0.1] * 15,
    *[0.1 - 0.12 * k for k in range(1, 8)],
    *(-0.7 - 0.08 * np.sin(0.35 * np.arange(110))).tolist(),
)


def truth(seed: int) -> tuple[float, ...]:
    generator = np.random.default_rng(seed)
    sd = np.array(PRIOR.deviations)
    sd[11:] = 0.0
    return tuple(
        (PRIOR.starting(14.0, -220.0).mean + sd * generator.uniform(-1.5, 1.5, 14)).tolist()
    )


def samples(theta: tuple[float, ...], noise: float, seed: int = 0, *, last: int = 133) -> Samples:
    """Return what is measured of a motion that scipy integrates."""
    motion, _, _ = Reference(theta, COMMANDS[: last - 1]).run(0.2 * np.arange(last))
    motion = motion + noise * np.random.default_rng(seed).standard_normal(motion.shape)
    s, v = (tuple(column.tolist()) for column in motion.T)
    return Samples(s, v, COMMANDS[: last - 1])


def test_recovers_the_truth_without_noise() -> None:
    """From the nominal numbers, first with the nominal prior, then with one that hardly matters."""
    theta = truth(1)
    motion, _ = MODEL.motion(theta, COMMANDS[:132])
    seen = Samples(tuple(motion[:, 0].tolist()), tuple(motion[:, 1].tolist()), COMMANDS[:132])
    start = PRIOR.starting(14.1, -220.5)
    near = MODEL.estimate(start.mean, seen, start, steps=20)
    wide = Prior.of(start.mean, 1e6 * np.array(PRIOR.covariance))
    found = MODEL.estimate(near.theta, seen, wide, steps=40)
    assert found.data_cost < 1e-4
    error = (np.array(found.theta) - theta) / np.array(PRIOR.deviations)
    names = list(PARAMETERS)
    sharp = ("electric_delay", "electric_lag", "electric_gain", "approach", "platform", "davis")
    for name in sharp:
        assert abs(error[names.index(name)]) < 1e-3
    # V_sw and T3 hardly differ in what they do; what they do together is found
    onset = [MODEL.motion(t, COMMANDS[:132])[0] for t in (theta, found.theta)]
    assert np.abs(onset[0] - onset[1]).max() < 1e-4


@pytest.mark.parametrize("last", [40, 133])
def test_is_the_maximum_a_posteriori(last: int) -> None:
    seen = samples(truth(2), 0.02, 3, last=last)
    prior = PRIOR.starting(seen.speeds[0], seen.positions[0])
    found = MODEL.estimate(prior.mean, seen, prior, steps=40)
    half = np.linalg.cholesky(np.linalg.inv(np.array(prior.covariance))).T
    sd = np.array(prior.deviations)

    def residuals(z: np.ndarray) -> np.ndarray:
        theta = prior.mean + sd * z
        motion, _ = MODEL.motion(tuple(theta.tolist()), seen.commands)
        missed = np.column_stack([seen.positions, seen.speeds]) - motion
        return np.concatenate([missed.ravel() / 0.02, half @ (theta - prior.mean)])

    best = least_squares(residuals, np.zeros(14), method="lm", xtol=1e-14, ftol=1e-14)
    assert found.data_cost + found.prior_cost == pytest.approx(2.0 * best.cost, rel=1e-6)
    z = (np.array(found.theta) - prior.mean) / sd
    assert z[:11] == pytest.approx(best.x[:11], abs=2e-3)
    # Gauss–Newton's information against that of scipy's Jacobian
    other = np.linalg.inv(best.jac.T @ best.jac)  # in sds of the prior
    mine = np.linalg.inv(found.information * np.outer(sd, sd))
    assert mine[:11, :11] == pytest.approx(other[:11, :11], abs=1e-3)


def test_wheel_scale_is_found_between_the_balises() -> None:
    theta, scale = truth(4), 0.008
    plain = samples(theta, 0.01, 5)
    s, v = np.array(plain.positions), np.array(plain.speeds)
    counted = np.where(s < -120.0, s - scale * 30.0, -120.0 + (1.0 + scale) * (s + 120.0))
    s, v = np.where(s < -20.0, counted, s), np.where(s < -20.0, (1.0 + scale) * v, v)
    model = BrakingModel(balises=(120.0, 20.0, 5.0))
    prior = Prior.nominal(changeover_speed=6.0 / 3.6, fade_rate=0.6, scale=0.007)
    seen = Samples(tuple(s.tolist()), tuple(v.tolist()), plain.commands)
    found = model.estimate(prior.starting(14.0, -220.0).mean, seen, prior, steps=30)
    assert found.theta[-1] == pytest.approx(scale, abs=4e-4)
    known = MODEL.estimate(prior.starting(14.0, -220.0).mean, plain, prior, steps=30)
    assert found.theta[2] == pytest.approx(known.theta[2], abs=3e-3)


def test_prior_has_the_spread_of_the_truth() -> None:
    n = 400_000
    draw = np.random.default_rng(1).uniform(-1.0, 1.0, (3, n))
    mass = 1.0 + 0.06 * draw[0]
    g = 0.85 * (1.0 + 0.06 * draw[1]) / mass
    k = 1.0142 / 1.191 * (1.0 + 0.10 * draw[2]) / mass
    names = list(PARAMETERS)
    i, j = names.index("electric_gain"), names.index("air_gain")
    expected = np.cov(g, k)
    found = np.array(PRIOR.covariance)[np.ix_([i, j], [i, j])]
    assert found == pytest.approx(expected, rel=0.02)
    assert PRIOR["approach"] == pytest.approx(2.0 * 9.81e-3)
    assert PRIOR.deviations[names.index("air_delay")] == pytest.approx(0.16 / np.sqrt(3.0))


def test_known_parameters_do_not_move() -> None:
    theta = truth(6)
    told = PRIOR.known({"air_gain": theta[5], "electric_gain": theta[2]})
    seen = samples(theta, 0.02, 7)
    found = MODEL.estimate(told.starting(14.0, -220.0).mean, seen, told, steps=20).theta
    assert found[5] == pytest.approx(theta[5], rel=1e-6)
    assert found[2] == pytest.approx(theta[2], rel=1e-6)
    with pytest.raises(ParameterError, match="did you mean 'air_gain'"):
        PRIOR.known({"air_gian": 1.0})
