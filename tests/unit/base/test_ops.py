import math

import casadi as ca
import pytest

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


def test_finite() -> None:
    assert ops.finite(1.0)
    assert ops.finite(ca.SX.sym("x"))
    assert not ops.finite(math.nan)
    assert not ops.finite(math.inf)
    assert not ops.finite("1")
