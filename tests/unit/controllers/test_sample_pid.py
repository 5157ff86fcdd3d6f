"""PID per sample: against plain sums, its limits, its filter; traced, too."""

import math
import random
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from railcosim.base.errors import RailcosimError
from railcosim.controllers import SamplePID
from tests.tracing import largest_difference

FREE = (math.inf, -math.inf)  # upper, lower
WIDE = (1e6, -1e6)


def forces(block: SamplePID, errors: Any, limits: tuple[float, float] = FREE) -> list[float]:
    """Return the forces for a sequence of errors, as a reference over a measurement of 0."""
    x, found = block.start(), []
    for e in errors:
        force, x = block.step(x, float(e), 0.0, *limits)
        found.append(force)
    return found


def noise(count: int, size: float = 1e5, seed: int = 3) -> list[float]:
    generator = random.Random(seed)
    return [generator.uniform(-size, size) for _ in range(count)]


def test_it_is_the_papers_sum() -> None:
    errors = np.array(noise(1000))
    expected = 0.8 * errors + 0.003 * np.cumsum(errors) + 4.0 * np.diff(errors, prepend=errors[0])
    found = forces(SamplePID(rate=math.inf), errors)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-8)  # of some 1e6 N


def test_no_kick_at_the_first_sample() -> None:
    assert forces(SamplePID(rate=math.inf), [1000.0, 1000.0]) == pytest.approx([803.0, 806.0])
    assert forces(SamplePID(rate=math.inf, kp=0.0, ki=0.0), [1000.0, 1000.0]) == [0.0, 0.0]


@pytest.mark.parametrize("filter_time", [0.0, 0.001, 0.05])
def test_the_derivatives_filter(filter_time: float) -> None:
    errors = np.array(noise(500))
    weight = 0.002 / (filter_time + 0.002)
    changes = np.diff(errors, prepend=errors[0])
    expected = 4.0 * np.asarray(lfilter([weight], [1.0, weight - 1.0], changes))
    block = SamplePID(kp=0.0, ki=0.0, filter_time=filter_time, rate=math.inf)
    np.testing.assert_allclose(forces(block, errors), expected, rtol=0.0, atol=1e-8)


def test_the_rate_is_limited_from_zero() -> None:
    block = SamplePID(kp=1.0, ki=0.0, kd=0.0)
    found = forces(block, [10e3] * 4 + [-1e3] * 4)
    assert found == [4e3, 8e3, 10e3, 10e3, 6e3, 2e3, -1e3, -1e3]
    free = SamplePID(kp=1.0, ki=0.0, kd=0.0, rate=math.inf)
    assert forces(free, [10e3, -1e3]) == [10e3, -1e3]


def test_the_limits_go_before_the_rate() -> None:
    """An envelope that falls quicker than the rate is kept to."""
    block = SamplePID(kp=1.0, ki=0.0, kd=0.0)
    _, x = block.step((0.0, 0.0, 50e3, 50e3, 0.0), 50e3, 0.0, *WIDE)
    force, x = block.step(x, 50e3, 0.0, 20e3, -1e6)
    assert force == 20e3
    assert block.step(x, 50e3, 0.0, *WIDE)[0] == 24e3


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_sum_stops_at_the_limits_and_lets_go_at_once(sign: float) -> None:
    held = [sign * 10e3] * 200
    back = [-sign * 100.0] * 400
    options: dict[str, Any] = {"kp": 1.0, "ki": 0.1, "kd": 0.0, "rate": math.inf}
    limits = (15e3, -15e3)
    stopped = forces(SamplePID(**options), held + back, limits)
    wound_up = forces(SamplePID(anti_windup=False, **options), held + back, limits)
    assert abs(stopped[199]) == abs(wound_up[199]) == 15e3
    assert abs(stopped[200]) < 5e3
    assert abs(wound_up[-1]) == 15e3


def test_what_leads_back_from_the_limit_is_summed() -> None:
    block = SamplePID(kp=0.0, ki=0.1, kd=0.0, rate=math.inf)
    x = (30e3, 0.0, 0.0, 0.0, 0.0)  # more than the limit, as after the envelope has shrunk
    force, following = block.step(x, -10e3, 0.0, 20e3, -20e3)
    assert force == 20e3
    assert following[0] == pytest.approx(29e3)
    assert block.step(x, 10e3, 0.0, 20e3, -20e3)[1][0] == 30e3


def test_the_rate_alone_stops_no_sum() -> None:
    block = SamplePID(kp=1.0, ki=0.1, kd=0.0)
    force, following = block.step(block.start(), 50e3, 0.0, *WIDE)
    assert force == 4e3
    assert following[0] == pytest.approx(5e3)


def test_a_mirrored_error_gives_the_mirrored_force() -> None:
    block = SamplePID(filter_time=0.004, rate=5e7)
    errors = noise(2000)
    there = forces(block, errors, (90e3, -60e3))
    back = forces(block, [-e for e in errors], (60e3, -90e3))
    assert there == [-f for f in back]
    assert {90e3, -60e3} < set(there)


def test_feed_forward_is_added_within_the_limits() -> None:
    block = SamplePID(kp=1.0, ki=0.0, kd=0.0, rate=math.inf, feed_forward=True)
    assert list(block.inputs) == ["reference", "measurement", "upper", "lower", "feed_forward"]
    assert block.step(block.start(), 3e3, 1e3, *WIDE, 500e3)[0] == 502e3
    assert block.step(block.start(), 3e3, 1e3, 100e3, 0.0, 500e3)[0] == 100e3


def test_of_a_speed() -> None:
    block = SamplePID(kp=2.0, ki=0.0, kd=0.0, unit="km/h", scale=20e3, rate=math.inf)
    assert block.inputs["reference"] == block.inputs["measurement"] == "km/h"
    assert block.inputs["upper"] == block.outputs["force"] == "N"
    assert block.step(block.start(), 40.0, 38.5, *WIDE)[0] == 60e3


def test_wrong_parameters() -> None:
    for options, words in (
        ({"kp": math.nan}, "kp must be a finite number"),
        ({"kd": math.inf}, "kd must be a finite number"),
        ({"scale": 0.0}, "scale must be a positive number"),
        ({"period": -0.002}, "period must be a positive number"),
        ({"filter_time": -1e-3}, "filter_time must be a time from 0 s"),
        ({"filter_time": math.inf}, "filter_time must be a time from 0 s"),
        ({"rate": 0.0}, "rate must be in N/s, or inf"),
        ({"rate": math.nan}, "rate must be in N/s, or inf"),
        ({"unit": "kNewton"}, "kNewton"),
    ):
        with pytest.raises(RailcosimError, match=words):
            SamplePID(**options)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    "block",
    [
        SamplePID(),
        SamplePID(anti_windup=False, rate=math.inf),
        SamplePID(filter_time=0.01, feed_forward=True),
    ],
)
def test_traced_at_random_points(block: SamplePID) -> None:
    generator = random.Random(5)
    states, inputs = [], []
    for _ in range(10_000):
        state = [generator.uniform(-1e5, 1e5) for _ in range(4)]
        states.append((*state, float(generator.random() < 0.1)))
        reference, lower = generator.uniform(-1e5, 1e5), generator.uniform(-2e5, 0.0)
        ports = (reference, generator.uniform(-1e5, 1e5), lower + generator.uniform(0, 4e5), lower)
        inputs.append(ports + (generator.uniform(-1e5, 1e5),) * block.feed_forward)
    assert largest_difference(block, states, inputs) <= 1e-12
