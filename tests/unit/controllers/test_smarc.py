"""SMARC: its adaptation by hand, its bounds, and that it lets the Lyapunov function fall."""

import random
from typing import Any

import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers import SMARC, SlidingMode
from tests.tracing import largest_difference

GAINS: dict[str, Any] = {"surface": 0.4, "reaching": 0.2, "robust": 0.1}


def test_by_hand() -> None:
    law = SMARC(**GAINS, adaptation=0.5, mass=1.2)
    # z = 0.4 · 1 + 0.2 = 0.6, q = −0.7 − 0.4 · 0.2 + 0.03 = −0.75
    (u, mass), following = law.step(law.start(), 1.0, 0.2, -0.7, 0.03)
    assert (u, mass) == (pytest.approx(-1.2 * 0.75 - 0.12 - 0.1), 1.2)
    assert following == pytest.approx(1.2 + 0.2 * 0.5 * 0.6 * 0.75)


def test_without_adaptation_it_is_the_sliding_mode() -> None:
    generator = random.Random(1)
    law, plain = SMARC(**GAINS, adaptation=0.0), SlidingMode(**GAINS)
    for _ in range(1000):
        errors = [generator.uniform(-2.0, 2.0) for _ in range(4)]
        (u, mass), following = law.step(law.start(), *errors)
        assert u == plain.step((), *errors)[0]
        assert mass == following == law.mass


def test_the_mass_stays_within_its_bounds_and_comes_back() -> None:
    law, generator = SMARC(**GAINS, adaptation=3.0), random.Random(2)
    low, high = law.bounds
    x = law.start()
    seen = set()
    for _ in range(5000):
        before = x
        errors = [generator.uniform(-2.0, 2.0) for _ in range(4)]
        _, x = law.step(x, *errors)
        assert low <= x <= high
        z = 0.4 * errors[0] + errors[1]
        q = errors[2] - 0.4 * errors[1] + errors[3]
        if before in (low, high):  # leaves the bound as soon as the rate points inwards
            inwards = -z * q > 0.0 if before == low else -z * q < 0.0
            assert (x != before) == inwards
            seen.add((before, inwards))
    assert len(seen) == 4


@pytest.mark.parametrize("mass", [0.9, 1.25, 1.6])
def test_the_lyapunov_function_falls(mass: float) -> None:
    """V = θ z²/2 + θ̃²/(2 λ) does not grow in the ideal loop of eq. 14, and z goes to 0."""
    law = SMARC(**GAINS, adaptation=0.8, mass=1.25, period=1e-3)
    x, e, rate, a_d, r = law.start(), 1.0, 0.5, -0.7, 0.04
    last = None
    for _ in range(60_000):
        z = law.surface * e + rate
        v = 0.5 * mass * z * z + 0.5 * (x - mass) * (x - mass) / law.adaptation
        assert last is None or v <= last + 1e-6
        last = v
        (u, _), x = law.step(x, e, rate, a_d, r)
        e, rate = e + rate * law.period, rate + (u / mass - r - a_d) * law.period
    assert abs(law.surface * e + rate) < 1e-3
    assert abs(e) < 1e-2


@pytest.mark.parametrize("boundary", [None, 0.3])
def test_traced_is_the_same(boundary: float | None) -> None:
    law, generator = SMARC(**GAINS, adaptation=1.5, boundary=boundary), random.Random(3)
    states = [generator.uniform(0.8, 1.7) for _ in range(2000)] + [0.8, 0.8, 1.7, 1.7]
    points = [tuple(generator.uniform(-2.0, 2.0) for _ in range(4)) for _ in states]
    assert largest_difference(law, states, points) <= 1e-12


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"mass": 1.8}, r"mass must lie within bounds \(0\.8, 1\.7\)"),
        ({"bounds": (1.7, 0.8)}, "bounds must be a pair"),
        ({"boundary": -1.0}, "boundary must be a positive number"),
    ],
)
def test_wrong_parameters_are_refused(options: Any, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        SMARC(**GAINS, adaptation=1.0, **options)
