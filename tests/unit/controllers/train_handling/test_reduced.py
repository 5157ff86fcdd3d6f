"""What a reduced train may be."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.base.errors import ParameterError
from railcosim.controllers.train_handling import ForceCurve

from .trains import BRAKE, TRAIN


def test_a_force_curve_is_lines_and_power() -> None:
    curve = ForceCurve(points=((1.0, 10.0), (3.0, 30.0), (6.0, 24.0)), power=120.0)
    speeds = np.linspace(0.1, 9.0, 90)
    expected = np.minimum(np.interp(speeds, [1.0, 3.0, 6.0], [10.0, 30.0, 24.0]), 120.0 / speeds)
    assert [float(curve.at(v)) for v in speeds] == pytest.approx(expected)


def test_one_shoe_of_20_kn_is_the_handbooks() -> None:
    """For K = 20 kN φ is known as 0.322 (V + 150)/(2 V + 150), rounded."""
    brake = replace(BRAKE, area=20.0 / BRAKE.full_pressure, shoes=1.0)
    assert brake.force(1.0, 15.0) == pytest.approx(20e3 * 0.322 * 204.0 / 258.0, rel=1e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"shares": (0.5, *(0.0,) * 12)}, "add up to 1, not 0.5"),
        ({"lengths": (35.0,)}, "13 masses, 1 lengths"),
        ({"masses": (-1.0, *(1e5,) * 12)}, "masses must be positive"),
        ({"braked": ()}, "13 masses, 0 braked"),
    ],
)
def test_trains_that_cannot_be(change: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        replace(TRAIN, **change)  # pyright: ignore[reportArgumentType]


def test_parts_that_cannot_be() -> None:
    with pytest.raises(ParameterError, match="rising speeds"):
        ForceCurve(points=((1.0, 10.0), (1.0, 30.0)))
    with pytest.raises(ParameterError, match="power must be positive"):
        ForceCurve(points=((1.0, 10.0),), power=0.0)
    with pytest.raises(ParameterError, match="its numbers must be positive"):
        replace(BRAKE, release_time=0.0)
    with pytest.raises(ParameterError, match=r"\(50, 200 kPa\) must lie .* to 170 kPa"):
        replace(BRAKE, maximum=200.0)
