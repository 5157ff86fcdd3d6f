from fractions import Fraction

import pytest

from railcosim.base.errors import DiagramError
from railcosim.cosim.clock import Clock, plus, rational


def test_times_are_the_numbers_one_types() -> None:
    clock = Clock(rational(0.05))
    assert [clock.time(k) for k in (1, 3, 7, 20)] == [0.05, 0.15, 0.35, 1.0]
    assert Clock(rational(0.1), rational(0.3)).time(3) == 0.6


def test_a_ratio_of_decimals_is_exact() -> None:
    assert rational(0.3) / rational(0.1) == 3
    assert plus(0.1, 0.2) == 0.3


@pytest.mark.parametrize("value", [1 / 3, 1 / 60, 0.002, 1e-9, 12345.678, 0.1 + 0.2])
def test_stands_for_its_float(value: float) -> None:
    assert float(rational(value)) == value


def test_the_integers_give_the_same_time() -> None:
    clock = Clock(rational(0.05), rational(1 / 3))
    a, b, q = clock.integers
    assert all((a + k * b) / q == clock.time(k) for k in range(1000))
    assert clock.times(1000) == [clock.time(k) for k in range(1000)]


def test_a_span_must_be_whole_ticks() -> None:
    clock = Clock(Fraction(1, 20))
    assert clock.ticks(0.15, "period") == 3
    with pytest.raises(DiagramError, match=r"stop = 0\.07 s .* nearest: 0\.05 or 0\.1 s"):
        clock.ticks(0.07, "stop")
