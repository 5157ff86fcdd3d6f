"""Odometry: noise by seed, the wheel's scale, balises and calibration."""

from typing import Any

import numpy as np
import pytest

from railcosim import Constant, Diagram, Profile
from railcosim.base.errors import ParameterError
from railcosim.controllers.odometry import Odometry

BALISES = (120.0, 20.0, 5.0)


def measured(block: Odometry, positions: Any, speed: float = 10.0) -> np.ndarray:
    x, rows = block.start(), []
    for position in positions:
        y, x = block.step(x, float(position), speed)
        rows.append(y)
    return np.array(rows)


def quiet(**options: Any) -> Odometry:
    return Odometry(position_noise=0.0, speed_noise=0.0, **options)


def test_exact_without_noise_and_scale() -> None:
    places = np.linspace(-200.0, 0.0, 101)
    found = measured(quiet(balises=BALISES), places)
    assert (found[:, 0] == places).all()
    assert (found[:, 1] == 10.0).all()


def test_noise_has_its_deviations_and_is_white() -> None:
    n = 20_000
    found = measured(Odometry(position_noise=0.03, speed_noise=0.01, seed=5), np.zeros(n), 0.0)
    assert found.std(axis=0) == pytest.approx([0.03, 0.01], rel=0.03)
    assert np.abs(found.mean(axis=0) / [0.03, 0.01]).max() < 4.0 / np.sqrt(n)
    cross = np.corrcoef(found.T)[0, 1]
    lagged = np.corrcoef(found[1:, 0], found[:-1, 0])[0, 1]
    assert max(abs(cross), abs(lagged)) < 4.0 / np.sqrt(n)


def test_seed_alone_decides() -> None:
    a, b, c = (measured(Odometry(seed=s), np.zeros(300)) for s in (1, 1, 2))
    assert (a == b).all()
    assert (a != c).all()


def test_scale_and_balises() -> None:
    found = measured(quiet(scale=0.01, balises=BALISES), [-220.0, -130.0, -119.0, -21.0, -19.0])
    assert found[:, 0] == pytest.approx(
        [
            -220.0,
            -220.0 + 1.01 * 90.0,
            -120.0 + 1.01,  # a balise ago
            -120.0 + 1.01 * 99.0,
            -19.0,  # calibrated
        ]
    )
    assert found[:, 1] == pytest.approx([10.1, 10.1, 10.1, 10.1, 10.0])


def test_without_calibration() -> None:
    block = quiet(scale=0.01, balises=BALISES, calibrate=False)
    found = measured(block, [-220.0, -19.0, -4.0, -1.0])
    assert found[:, 0] == pytest.approx([-220.0, -20.0 + 1.01, -5.0 + 1.01, -5.0 + 1.01 * 4.0])
    assert found[:, 1] == pytest.approx(10.1)


def test_two_balises_within_one_sample_calibrate_too() -> None:
    found = measured(quiet(scale=-0.02, balises=(10.0, 9.0)), [-50.0, -8.0])
    assert found[1] == pytest.approx([-8.0, 10.0])


def test_a_balise_behind_the_start_is_of_no_use() -> None:
    found = measured(quiet(scale=0.01, balises=BALISES), [-60.0, -19.0])
    assert found[1] == pytest.approx([-20.0 + 1.01, 10.1])


def test_samples_are_held_in_a_diagram() -> None:
    loop = Diagram("odometry", step=0.05)
    loop.add("place", Profile(((0.0, -10.0), (10.0, 0.0)), unit="m"))
    loop.add("speed", Constant(1.0, unit="m/s"))
    loop.add("odometry", quiet())
    loop.connect("place.y", "odometry.position")
    loop.connect("speed.y", "odometry.speed")
    run = loop.run(1.0)
    assert run["odometry.position"][:9] == pytest.approx([-10.0] * 4 + [-9.8] * 4 + [-9.6])


def test_wrong_numbers_are_refused() -> None:
    changes: list[tuple[dict[str, Any], str]] = [
        ({"position_noise": -0.1}, "position_noise must not be negative"),
        ({"speed_noise": float("nan")}, "speed_noise must be a finite number"),
        ({"scale": -1.0}, "scale must be above -1"),
        ({"seed": -1}, "seed must be a whole number"),
        ({"balises": (5.0, 20.0)}, "distances before the mark that fall"),
        ({"period": 0.0}, "period must be a positive number"),
    ]
    for change, words in changes:
        with pytest.raises(ParameterError, match=words):
            Odometry(**change)
