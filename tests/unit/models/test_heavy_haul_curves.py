"""Piecewise linear curves in CasADi against numpy's."""

import casadi as ca
import numpy as np
import pytest

from railcosim.models.consist import coal_train
from railcosim.models.expressions import exact_expressions
from railcosim.models.heavy_haul.mapping import ramps

Points = list[tuple[float, float]]


def difference(points: Points) -> float:
    """Return the largest difference, over the steepest slope or 1."""
    x, (at, values) = ca.SX.sym("x"), np.array(points).T
    with exact_expressions():
        curve = ca.Function("curve", [x], [ramps(x, points)])
    span = at[-1] - at[0]
    where = np.concatenate([np.linspace(at[0] - span, at[-1] + span, 301), at])
    found = np.array([float(curve(one)) for one in where])
    steepest = np.abs(np.diff(values) / np.diff(at)).max()
    return float(np.abs(found - np.interp(where, at, values)).max()) / max(steepest, 1.0)


@pytest.mark.parametrize("kind", ["any", "concave", "convex", "rise, then fall", "monotone"])
def test_random_curves(kind: str) -> None:
    rng = np.random.default_rng(len(kind))
    for _ in range(60):
        count = int(rng.integers(1, 8))
        at = np.cumsum([rng.choice([0.0, -2.0, 0.5]), *rng.uniform(0.05, 2.0, count)])
        slopes = rng.choice([-1.0, 0.0, 0.5, 1.0, 2.0], count) + rng.normal(size=count).round(1)
        if kind in ("concave", "convex"):
            slopes = np.sort(slopes)[:: -1 if kind == "concave" else 1]
        elif kind == "rise, then fall":
            turn = int(rng.integers(0, count + 1))
            slopes = np.concatenate([np.sort(slopes[:turn]), np.sort(slopes[turn:])[::-1]])
        elif kind == "monotone":
            slopes = np.abs(slopes)
        values = np.cumsum([rng.choice([0.0, 1.0]), *slopes * np.diff(at)])
        points = [(float(a), float(b)) for a, b in zip(at, values, strict=True)]
        assert difference(points) < 1e-13, points


def test_the_service_curve_is_exactly_zero_without_a_reduction() -> None:
    brake = next(v.brake for v in coal_train().vehicles if v.brake is not None)
    x = ca.SX.sym("x")
    with exact_expressions():
        curve = ca.Function("curve", [x], [ramps(x, brake.service)])
    assert [float(curve(r)) for r in (0.0, -5.0)] == [0.0, 0.0]
    assert difference(list(brake.service)) < 1e-14


def test_a_level_curve() -> None:
    assert float(ramps(ca.DM(3.0), [(0.0, 2.0), (1.0, 2.0)])) == 2.0
