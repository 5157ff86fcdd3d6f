"""The braking model: against scipy with exact delays, its derivatives, its plans."""

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers.predictive_stop import BrakingModel, Plan, Prior, Probe
from tests.braking_reference import Reference

TRAINS = {"v12": (12.0 / 3.6, 0.30), "v6": (6.0 / 3.6, 0.60), "v3": (3.0 / 3.6, 1.20)}
MODEL = BrakingModel()
PROBING = BrakingModel(probe=Probe(level=-0.25, length=1.8))
PROBED = (3.0, 20.6)  # s: early, and about the changeover


def drawn(train: str, seed: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return parameters within the spread, and commands that bring the train to a stop."""
    generator = np.random.default_rng(seed)
    speed, rate = TRAINS[train]
    prior = Prior.nominal(changeover_speed=speed, fade_rate=rate, approach=-5.0, platform=2.0)
    sd = np.array(prior.deviations)
    sd[11:] = 0.0
    theta = prior.starting(14.0, -200.0).mean + sd * generator.uniform(-1.7, 1.7, sd.size)
    ramp = [0.1 - 0.12 * k for k in range(1, 8)]
    wild = -0.75 + 0.1 * generator.standard_normal(150)
    return tuple(theta.tolist()), (*[0.1] * 5, *ramp, *wild.tolist())


@pytest.mark.parametrize("train", TRAINS)
def test_motion_is_that_of_the_equations(train: str) -> None:
    theta, commands = drawn(train, 1)
    motion, _ = MODEL.motion(theta, commands)
    expected, stop, time = Reference(theta, commands).run(0.2 * np.arange(len(commands) + 1))
    assert np.abs(motion - expected).max(axis=0) == pytest.approx([0.0, 0.0], abs=1e-3)
    assert np.abs(motion - expected).max(axis=0)[1] < 1e-4
    assert motion[-1, 0] == pytest.approx(stop, abs=1e-3)
    assert 0.2 * np.flatnonzero(motion[:, 1] == 0.0)[0] == pytest.approx(time, abs=0.2)


@pytest.mark.parametrize("probed", PROBED)
@pytest.mark.parametrize("train", TRAINS)
def test_motion_with_a_probe_is_that_of_the_equations(train: str, probed: float) -> None:
    theta, commands = drawn(train, 8)
    times = 0.2 * np.arange(len(commands) + 1)
    motion, _ = PROBING.motion(theta, commands, probed=probed)
    reference = Reference(theta, commands, (-0.25, probed, probed + 1.8))
    expected, stop, _ = reference.run(times)
    assert np.abs(motion - expected).max(axis=0) == pytest.approx([0.0, 0.0], abs=1e-3)
    assert np.abs(motion - expected).max(axis=0)[1] < 1e-4
    assert motion[-1, 0] == pytest.approx(stop, abs=1e-3)
    without, _ = PROBING.motion(theta, commands)
    assert (without == MODEL.motion(theta, commands)[0]).all()
    assert without[-1, 0] - motion[-1, 0] > 0.05


@pytest.mark.parametrize("probed", [np.inf, *PROBED])
@pytest.mark.parametrize("train", TRAINS)
@pytest.mark.parametrize("seed", [2, 3])
def test_derivatives(train: str, seed: int, probed: float) -> None:
    """By central differences of two widths, extrapolated; samples at an event's very edge apart."""
    theta, commands = drawn(train, seed)
    _, slopes = PROBING.motion(theta, commands, probed=probed)
    assert slopes.shape == (len(commands) + 1, 2, 13)
    for k in range(13):
        size = 2e-5 * max(abs(theta[k]), 0.1)

        def difference(h: float, k: int = k) -> np.ndarray:
            ends = [
                PROBING.motion(
                    tuple(t + s * h * (i == k) for i, t in enumerate(theta)),
                    commands,
                    probed=probed,
                )[0]
                for s in (1.0, -1.0)
            ]
            return (ends[0] - ends[1]) / (2.0 * h)

        found = (4.0 * difference(size / 2.0) - difference(size)) / 3.0
        scale = np.abs(slopes[:, :, k]).max()
        assert scale > 0.0
        missed = np.abs(found - slopes[:, :, k]).max(axis=1) / scale
        assert np.sort(missed)[:-3].max() < 1e-6  # a sample within ±h of stop or onset has a kink


def test_plan_is_the_motion_under_its_commands() -> None:
    theta, commands = drawn("v6", 4)
    past = commands[:40]
    plan = Plan(limits=(-0.9, -0.2))
    found = MODEL.plan(theta, past, past[-1], -0.8, plan)
    after = [past[-1]]
    for _ in range(140):
        after.append(after[-1] + max(-0.12, min(0.12, -0.8 - after[-1])))
    motion, _ = MODEL.motion(theta, (*past, *after[1:]))
    assert found.stop == pytest.approx(motion[-1, 0], abs=1e-9)
    assert found.speed == pytest.approx(motion[40, 1], abs=1e-12)
    assert found.command == after[1]


def test_plan_reckons_with_a_probe_to_come() -> None:
    theta, commands = drawn("v6", 9)
    past = commands[:20]
    for probed in (3.4, 4.6):  # acting at the plan's beginning, and to come
        found = PROBING.plan(theta, past, past[-1], -0.8, Plan(), probed=probed)
        after = [past[-1]]
        for _ in range(140):
            after.append(after[-1] + max(-0.12, min(0.12, -0.8 - after[-1])))
        motion, _ = PROBING.motion(theta, (*past, *after[1:]), probed=probed)
        assert found.stop == pytest.approx(motion[-1, 0], abs=1e-9)


@pytest.mark.parametrize("ending", [1.0, 0.4])
def test_plan_slope_and_law(ending: float) -> None:
    theta, commands = drawn("v6", 5)
    past = commands[:40]
    plan = Plan(ending=ending, slow=2.0, fast=3.0)

    def stop(level: float) -> float:
        return MODEL.plan(theta, past, past[-1], level, plan).stop

    slope = MODEL.plan(theta, past, past[-1], -0.77, plan).slope
    assert slope == pytest.approx((stop(-0.77 + 1e-5) - stop(-0.77 - 1e-5)) / 2e-5, rel=1e-3)
    aim = stop(-0.7)
    there = MODEL.plan(theta, past, past[-1], -0.77, plan._replace(aim=aim), iterations=5)
    assert there.level == pytest.approx(-0.7, abs=1e-4)
    assert there.stop == pytest.approx(aim, abs=1e-4)


def test_ending_takes_its_share_of_the_level() -> None:
    theta, commands = drawn("v6", 6)
    plan = Plan(ending=0.5, slow=13.9, fast=15.0)  # at once
    found = MODEL.plan(theta, commands[:1], -0.4, -0.8, plan)
    assert found.command == pytest.approx(-0.4 - 0.8 * 0.5 * (found.speed - 13.9) / 1.1, abs=1e-12)


def test_too_long_a_history_is_refused() -> None:
    theta, _ = drawn("v6", 7)
    with pytest.raises(ParameterError, match="fewer than 1024 commands, not 1024"):
        MODEL.plan(theta, (-0.1,) * 1024, -0.1, -0.8, Plan())


def test_bits_are_the_same() -> None:
    theta, commands = drawn("v6", 7)
    first, again = (MODEL.motion(theta, commands) for _ in range(2))
    assert all((a == b).all() for a, b in zip(first, again, strict=True))
