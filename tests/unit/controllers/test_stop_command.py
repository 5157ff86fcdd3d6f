"""The last stage: limits, the least brake at low speed, and the hold."""

import random
from typing import Any

import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers import StopCommand
from tests.tracing import largest_difference

STAGE = StopCommand()


@pytest.mark.parametrize(
    ("last", "wanted", "speed", "command"),
    [
        (-0.5, -0.7, 10.0, -0.7),
        (-0.5, -1.7, 10.0, -1.0),
        (-0.5, 0.9, 10.0, 0.5),
        (-0.5, 0.1, 1.0, 0.1),
        (-0.5, 0.1, 0.99, -0.15),
        (-0.5, -0.4, 0.99, -0.4),
        (-0.5, -0.4, 0.25, -0.4),
        (-0.5, -0.4, 0.24, -0.5),
        (0.2, -0.4, 0.0, -0.15),
    ],
)
def test_by_hand(last: float, wanted: float, speed: float, command: float) -> None:
    assert STAGE.step(last, wanted, speed) == (command, command)


def test_traced_is_the_same() -> None:
    generator = random.Random(6)
    states = [generator.uniform(-1.0, 0.5) for _ in range(2000)]
    speeds = [generator.choice((0.0, 0.25, 1.0, generator.uniform(-0.1, 2.0))) for _ in states]
    points = [(generator.uniform(-2.0, 1.0), v) for v in speeds]
    assert largest_difference(STAGE, states, points) == 0.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"limits": (0.5, -1.0)}, "limits must be a pair"),
        ({"hold": 1.5}, "hold must not be above slow"),
    ],
)
def test_wrong_parameters_are_refused(options: Any, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        StopCommand(**options)
