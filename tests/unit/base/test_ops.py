import math
from decimal import ROUND_HALF_UP, Decimal

import casadi as ca
import numpy as np
import pytest
import scipy.special

from railcosim.base import ops


@pytest.mark.parametrize("a", [-1.5, 0.0, 0.5, 2.0])
@pytest.mark.parametrize("b", [-1.0, 0.5, 3.0])
def test_same_on_floats_and_symbols(a: float, b: float) -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    for operation in (
        ops.minimum,
        ops.maximum,
        lambda p, q: ops.clip(p, -1.0, q),
        lambda p, q: ops.where(p < q, p, q * 2.0),
        lambda p, q: ops.absolute(p - q),
    ):
        traced = ca.Function("f", [x, y], [operation(x, y)])
        assert float(traced(a, b)) == operation(a, b)


@pytest.mark.parametrize(
    ("operation", "reference", "low", "high"),
    [
        (ops.exp, np.exp, -700.0, 700.0),
        (ops.log, np.log, 1e-300, 1e3),
        (ops.sqrt, np.sqrt, 0.0, 1e3),
        (ops.floor, np.floor, -7.0, 7.0),
        (ops.erf, scipy.special.erf, -7.0, 7.0),
        (ops.erfinv, scipy.special.erfinv, -1.0 + 2.0**-53, 1.0 - 2.0**-53),
    ],
)
def test_functions_on_floats_and_symbols(operation, reference, low: float, high: float) -> None:
    """To a few units of round-off; erfinv's slope takes those of its argument near 1 further."""
    x = ca.SX.sym("x")
    traced = ca.Function("f", [x], [operation(x)])
    for a in np.linspace(low, high, 2001).tolist():
        value = operation(a)
        assert type(value) is float
        assert float(traced(a)) == pytest.approx(value, rel=1e-15, abs=1e-300)
        assert value == pytest.approx(float(reference(a)), rel=2e-15, abs=1e-300)


def test_erfinv_is_accurate_in_its_tails_and_about_zero() -> None:
    near_one = 1.0 - np.logspace(-15.9, -1, 500)
    small = np.logspace(-300, -1, 500)
    for a in (*near_one.tolist(), *small.tolist(), *(-near_one).tolist()):
        assert ops.erfinv(a) == pytest.approx(float(scipy.special.erfinv(a)), rel=2e-15)
    assert ops.erfinv(0.0) == 0.0


@pytest.mark.parametrize("a", [-2.0, -1.5, -1.0, -0.0, 0.5, 1.0, math.nextafter(1.0, 0.0)])
def test_floor_at_whole_numbers(a: float) -> None:
    assert ops.floor(a) == math.floor(a)
    assert type(ops.floor(a)) is float


def test_rounding_of_halves_away_from_zero_is_exact() -> None:
    x = ca.SX.sym("x")
    traced = ca.Function("f", [x], [ops.round_half_away(x)])
    halves = [0.5 * k for k in range(-9, 10)]
    near = [math.nextafter(h, side) for h in halves for side in (-math.inf, math.inf)]
    for a in (*halves, *near, 2.0**52 + 1.0, -(2.0**53), 1e300):
        exact = Decimal(a).to_integral_value(ROUND_HALF_UP)  # up in size, so away from zero
        assert ops.round_half_away(a) == float(traced(a)) == exact


def test_numpys_numbers_are_numbers() -> None:
    for operation in (ops.exp, ops.log, ops.sqrt, ops.floor, ops.erf, ops.erfinv):
        assert operation(np.float64(0.3)) == operation(0.3)


def test_finite() -> None:
    assert ops.finite(1.0)
    assert ops.finite(ca.SX.sym("x"))
    assert not ops.finite(math.nan)
    assert not ops.finite(math.inf)
    assert not ops.finite("1")
