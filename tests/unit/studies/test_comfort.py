"""Comfort of rides whose figures can be written down."""

import math

import numpy as np
import pytest

from railcosim.studies.comfort import JERK_WINDOW, comfort, reversals


@pytest.mark.parametrize("spacing", [0.001, 0.01, 0.05, 0.1])
def test_of_a_sine_whatever_the_spacing_of_rows(spacing: float) -> None:
    """a = A sin ωt over whole periods; the mean jerk over W is (2A/W) sin(ωW/2) cos(…)."""
    amplitude, omega, count = 1.5, 0.5 * math.pi, round(40.0 / spacing)
    time = np.arange(count + 1) * spacing
    found = comfort(time, amplitude * np.sin(omega * time), np.sin(omega * time), swing=0.1)
    jerk = 2.0 * amplitude / JERK_WINDOW * math.sin(0.5 * omega * JERK_WINDOW)
    assert found["max_acceleration"] == pytest.approx(amplitude, rel=1e-4)
    assert found["rms_acceleration"] == pytest.approx(amplitude / math.sqrt(2.0), rel=2e-3)
    assert found["max_jerk"] == pytest.approx(jerk, rel=4e-3)
    assert found["rms_jerk"] == pytest.approx(jerk / math.sqrt(2.0), rel=4e-3)
    assert found["control_reversals"] == 20.0  # two in each of ten periods


def test_a_jump_of_acceleration_gives_the_same_jerk_at_any_spacing() -> None:
    for spacing in (0.001, 0.01, 0.1):
        time = np.arange(round(10.0 / spacing) + 1) * spacing
        found = comfort(time, np.where(time > 5.0, 1.0, 0.0), time, swing=0.1)
        assert found["max_jerk"] == pytest.approx(1.0 / JERK_WINDOW)


def test_rows_further_apart_than_the_window() -> None:
    found = comfort(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, -1.0]), np.zeros(3), swing=1.0)
    assert found["max_jerk"] == pytest.approx(2.0)


def test_too_few_rows() -> None:
    found = comfort(np.zeros(2), np.zeros(2), np.zeros(2), swing=1.0)
    assert set(found.values()) == {None}


def test_reversals_need_a_swing() -> None:
    assert reversals(np.array([0.0, 1.0, 0.95, 1.2, 1.1, 2.0]), 0.5) == 0
    assert reversals(np.array([0.0, 1.0, 0.4, 0.5, 0.0]), 0.5) == 1
    assert reversals(np.array([0.0, -1.0, 0.0, -1.0, 0.0]), 1.0) == 3
    assert reversals(np.array([0.0, 0.3, 0.0, 0.3, 0.0]), 0.5) == 0
    assert reversals(np.ones(10), 0.5) == 0
    assert reversals(np.array([1.0, 0.0, 0.0, 1.0, 1.0]), 0.5) == 1


def test_reversals_are_counted_alike_upside_down_and_backwards() -> None:
    generator = np.random.default_rng(4)
    for _ in range(50):
        control = np.cumsum(generator.normal(size=300))
        count = reversals(control, 3.0)
        assert count > 3
        assert reversals(-control, 3.0) == count
        assert reversals(control[::-1], 3.0) == count
