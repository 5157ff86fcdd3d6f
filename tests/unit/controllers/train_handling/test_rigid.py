"""Coupler forces of the rigid train, against the balance of every single vehicle."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.controllers.train_handling import RigidTrain

from .trains import TRAIN, WAVES

G = 9.81  # m/s²


def test_every_vehicle_is_in_balance() -> None:
    """From the front: F_j = F_{j−1} + pull − m a − resistance − gradient − shoes."""
    masses = tuple(np.random.default_rng(1).uniform(2e4, 2e5, 13).tolist())
    shares = (0.6, *(0.0,) * 5, 0.4, *(0.0,) * 6)
    train = replace(TRAIN, masses=masses, shares=shares)
    rigid = RigidTrain(train=train, section=WAVES)
    position, speed = np.array([200.0, 640.0, 1180.0]), np.array([8.0, 12.0, 15.0])
    force, share = np.array([150e3, -90e3, 20e3]), np.array([0.0, 0.3, 0.7])
    found = rigid.coupler_forces(position, speed, force, share)
    for n in range(3):
        v = 3.6 * speed[n]
        k = 0.0479 * 420.0 * share[n]
        shoe = 8e3 * k * 0.41 * (k + 200) / (4 * k + 200) * (v + 150) / (2 * v + 150)
        drags, front = [], position[n]
        for i, mass in enumerate(masses):
            a, b, c = train.resistances[i]
            places = front - train.lengths[i] * (np.arange(1000) + 0.5) / 1000
            slope = np.mean([WAVES.gradient_at(max(s, 0.0)) for s in places])
            drags.append(mass * G / 1000 * (a + b * v + c * v * v + slope) + (shoe if i else 0.0))
            front -= train.lengths[i]
        a = (force[n] - sum(drags)) / sum(masses)
        coupler = 0.0
        for i, mass in enumerate(masses[:-1]):
            coupler += shares[i] * force[n] - drags[i] - mass * a
            assert found[i, n] == pytest.approx(coupler, rel=1e-3, abs=30.0)


def test_pulled_on_the_level_forces_fall_with_the_mass_behind() -> None:
    flat = replace(WAVES, gradients=((0.0, 0.0),))
    same = replace(TRAIN, resistances=((1.0, 0.01, 0.0),) * 13)
    rigid = RigidTrain(train=same, section=flat)
    found = rigid.coupler_forces(np.array([900.0]), np.array([10.0]), np.array([140e3]))
    assert found[:, 0] == pytest.approx(140e3 * np.arange(12, 0, -1) / 14.0, rel=1e-12)
