"""The braking pattern: cruise, one step down, the stopping curve, and nothing beyond."""

import math
import random
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers.braking_pattern import BrakingPattern
from railcosim.fmus import trace

OPTIONS: dict[str, float] = {
    "cruise": 10.0, "regulated": 7.0, "regulation_from": 60.0, "stop": 250.0, "braking": 0.5,
}  # fmt: skip
PATTERN = BrakingPattern(**OPTIONS)


def target(position: float) -> float:
    return PATTERN.step(PATTERN.start(), position)[0]


def test_by_hand() -> None:
    assert PATTERN.braking_from == 201.0
    assert target(-5.0) == target(math.nextafter(60.0, 0.0)) == 10.0
    assert target(60.0) == target(150.0) == target(200.9) == 7.0
    assert target(201.0) == pytest.approx(7.0, abs=1e-12)
    assert target(226.0) == pytest.approx(math.sqrt(24.0))
    assert target(249.0) == 1.0
    assert target(250.0) == target(251.0) == 0.0


def test_it_does_not_rise() -> None:
    targets = [target(s) for s in np.linspace(0.0, 260.0, 5001).tolist()]
    assert all(b <= a for a, b in pairwise(targets))


def test_the_step_may_come_just_where_the_curve_begins() -> None:
    assert BrakingPattern(**{**OPTIONS, "regulation_from": 201.0}).step((), 201.0)[0] == 7.0


def test_traced_is_the_same() -> None:
    traced, generator = trace(PATTERN), random.Random(17)
    places = [generator.uniform(-10.0, 300.0) for _ in range(10_000)]
    for edge in (60.0, 201.0, 250.0):
        places += [edge, math.nextafter(edge, -math.inf), math.nextafter(edge, math.inf)]
    y, _ = traced.map(len(places))(ca.DM(0, len(places)), ca.DM(places).T, ca.DM(0, len(places)))
    expected = [target(s) for s in places]
    assert np.array(ca.densify(y)).ravel() == pytest.approx(expected, abs=1e-12)


def test_a_parameter_can_be_a_symbol() -> None:
    traced = trace(PATTERN, parameters=["stop", "regulated"])
    y, _ = traced([], [220.0], [260.0, 8.0])
    assert (
        float(y)
        == BrakingPattern(**{**OPTIONS, "stop": 260.0, "regulated": 8.0}).step((), 220.0)[0]
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"cruise": 0.0}, "cruise must be a positive number"),
        ({"regulated": 11.0}, r"regulated must not be above cruise \(10 m/s\), not 11 m/s"),
        ({"braking": math.inf}, "braking must be a positive number"),
        ({"stop": math.nan}, "stop must be a finite number"),
        ({"regulation_from": 202.0}, "must lie before 201 m, where the stopping curve meets 7 m/s"),
        ({"period": 0.0}, "period must be a positive number"),
    ],
)
def test_wrong_parameters_are_refused(options: Any, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        BrakingPattern(**{**OPTIONS, **options})
