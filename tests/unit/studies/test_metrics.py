"""Metrics of signals whose values can be written down."""

import math

import numpy as np
import pytest

from railcosim.studies.metrics import disturbance_response, step_response, tracking

T = np.linspace(0.0, 40.0, 4001)
ONE = np.ones_like(T)


def test_first_order_lag() -> None:
    """y = r (1 − e^(−t)): rise ln 9, settling ln 50, IAE r, ITAE r."""
    for target in (1.0, 5.0):
        found = step_response(T, target * (1.0 - np.exp(-T)), target * ONE)
        assert found["rise_time"] == pytest.approx(math.log(9.0), abs=1e-4)
        assert found["settling_time"] == pytest.approx(math.log(50.0), abs=1e-4)
        assert found["overshoot"] == 0.0
        assert found["steady_state_error"] == pytest.approx(0.0, abs=1e-12)
        assert found["iae"] == pytest.approx(target, rel=1e-4)
        assert found["itae"] == pytest.approx(target, rel=1e-4)


def test_overshoot_of_a_second_order_system() -> None:
    """Damping 0.5: overshoot exp(−π ζ / √(1−ζ²)) = 16.3 %."""
    zeta = 0.5
    w = math.sqrt(1.0 - zeta * zeta)
    y = 1.0 - np.exp(-zeta * T) * (np.cos(w * T) + zeta / w * np.sin(w * T))
    found = step_response(T, y, ONE)
    assert found["overshoot"] == pytest.approx(100 * math.exp(-math.pi * zeta / w), abs=1e-3)


def test_static_error_and_what_never_comes() -> None:
    found = step_response(T, 0.5 * (1.0 - np.exp(-T)), ONE)
    assert found["steady_state_error"] == pytest.approx(50.0)
    assert found["rise_time"] is None
    assert found["settling_time"] is None


def test_inside_the_band_only_at_the_end_is_not_settled() -> None:
    y = np.where(T < 39.0, 1.5, 1.0)
    assert step_response(T, y, ONE)["settling_time"] is None
    y = np.where(T < 30.0, 1.5, 1.0)
    assert step_response(T, y, ONE)["settling_time"] == pytest.approx(30.0, abs=0.01)


def test_time_counts_from_the_first_row() -> None:
    late = step_response(T + 100.0, 1.0 - np.exp(-T), ONE)
    assert late["rise_time"] == pytest.approx(math.log(9.0), abs=1e-4)
    assert late["itae"] == pytest.approx(1.0, rel=1e-4)
    assert late["settling_time"] == pytest.approx(math.log(50.0), abs=1e-4)


def test_disturbance() -> None:
    y = np.ones_like(T)
    y[(T >= 10.0) & (T < 20.0)] = 0.9
    y[(T >= 20.0) & (T < 25.0)] = 1.05
    found = disturbance_response(T, y, ONE, np.where((T >= 10.0) & (T < 20.0), -0.2, 0.0))
    assert found["dip"] == pytest.approx(10.0)
    assert found["rebound"] == pytest.approx(5.0)
    assert found["recovery_time"] == pytest.approx(5.0, abs=0.01)
    assert found["iae"] == pytest.approx(10 * 0.1 + 5 * 0.05, abs=0.01)


def test_tracking() -> None:
    found = tracking(T, np.sin(T), np.sin(T) + 0.2)
    assert found["rms_error"] == pytest.approx(0.2)
    assert found["max_error"] == pytest.approx(0.2)
    assert found["iae"] == pytest.approx(0.2 * 40.0)


def test_a_later_step_counts_from_when_it_happens() -> None:
    reference = np.where(T < 10.0, 0.0, 2.0)
    y = np.where(T < 10.0, 0.0, 2.0 * (1.0 - np.exp(-(T - 10.0))))
    found = step_response(T, y, reference)
    assert found["rise_time"] == pytest.approx(math.log(9.0), abs=1e-4)
    assert found["settling_time"] == pytest.approx(math.log(50.0), abs=1e-4)
    assert found["iae"] == pytest.approx(2.0, rel=1e-3)


def test_without_a_step_or_disturbance_there_is_nothing_to_measure() -> None:
    for reference in (0.0 * ONE, T, np.where(T < 10.0, 1.0, 2.0)):
        assert set(step_response(T, ONE, reference).values()) == {None}
    for disturbance in (0.0 * ONE, ONE):
        assert set(disturbance_response(T, ONE, ONE, disturbance).values()) == {None}


def test_a_step_down_from_a_speed() -> None:
    """10 → 7 m/s by a first-order lag that undershoots by a tenth: counted from 10, not from 0."""
    found = step_response(T, 7.0 + 3.0 * np.exp(-T), 7.0 * ONE, start=10.0)
    assert found["rise_time"] == pytest.approx(math.log(9.0), abs=1e-4)
    assert found["settling_time"] == pytest.approx(math.log(50.0), abs=1e-4)
    assert found["overshoot"] == 0.0
    assert found["iae"] == pytest.approx(3.0, rel=1e-4)
    low = step_response(T, 6.7 + 3.3 * np.exp(-T), 7.0 * ONE, start=10.0)
    assert low["overshoot"] == pytest.approx(10.0, abs=1e-6)
    assert low["steady_state_error"] == pytest.approx(-10.0, abs=1e-6)
    assert step_response(T, 7.0 * ONE, 7.0 * ONE, start=7.0)["rise_time"] is None
