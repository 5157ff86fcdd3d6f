"""Metrics of a response. The definitions stand in docs/results.md as well."""

import numpy as np

BAND = 0.02  # of the step: settled
FINAL = 5.0  # s at the end: the steady-state error's mean, and the least stay in the band

Metrics = dict[str, float | None]

UNITS = {
    "rise_time": "s",
    "settling_time": "s",
    "overshoot": "%",
    "steady_state_error": "%",
    "iae": "m",
    "itae": "m.s",
    "rms_error": "m/s",
    "max_error": "m/s",
    "dip": "%",
    "rebound": "%",
    "recovery_time": "s",
    "rms_force_error": "kN",
    "max_force_error": "kN",
    "peak_tension": "kN",
    "peak_tension_at": "1",
    "peak_compression": "kN",
    "peak_compression_at": "1",
    "rms_coupler_force": "kN",
    "max_force_rate": "kN/s",
    "rolled_back": "m",
    "largest_swing": "kN",
    "rms_force_rate": "kN/s",
    "traction_energy": "kWh",
    "net_energy": "kWh",
    "energy_residual": "1",
    "negative_gains": "%",
    "table_error": "1",
    "largest_table_error": "1",
    "mirror_error": "kN",
    "speed_spread": "m/s",
    "evaluations_per_step": "1",
    "stop_error": "cm",
    "mean_stop_error": "cm",
    "sd_stop_error": "cm",
    "largest_stop_error": "cm",
    "p95_stop_error": "cm",
    "p99_stop_error": "cm",
    "within_8_cm": "%",
    "within_10_cm": "%",
    "within_30_cm": "%",
    "within_50_cm": "%",
    "stops": "1",
    "stop_time": "s",
    "stopped": "1",
    "command_travel": "m/s2",
    "rms_speed_error": "cm/s",
    "rms_speed_error_fast": "cm/s",
    "rms_speed_error_slow": "cm/s",
    "worst_log": "cm/s",
    "model_time": "s",
    "loop_time": "s",
    "fit_time": "s",
    "coefficient_error": "%",
    "delay_error": "s",
    "evaluations": "1",
    "identified_t1": "s",
    "identified_t2": "s",
    "identified_p1": "1",
    "identified_t3": "s",
    "identified_t4": "s",
    "identified_k": "m/s2",
    "largest_singular_value": "cm/s",
    "least_singular_value": "cm/s",
    "lost_directions": "1",
    "correlation_t4_k": "1",
    "correlation_t1_t2": "1",
    "late": "s",
    "energy": "kWh",
    "planned_energy": "kWh",
    "coasting_energy": "kWh",
    "fast_energy": "kWh",
    "overspeed": "m/s",
    "warning": "1",
    "emergency": "1",
    "stop_jolt": "m/s2",
    "control_travel": "cm",
    "running_time": "s",
    "least_margin": "m/s",
    "mean_least_margin": "m/s",
    "emergency_at": "s",
    "end_speed": "m/s",
    "end_position": "m",
    "warnings": "1",
    "interventions": "1",
    "emergencies": "1",
    "violations": "1",
    "standing": "1",
    "runs": "1",
    "max_acceleration": "m/s2",
    "rms_acceleration": "m/s2",
    "max_jerk": "m/s3",
    "rms_jerk": "m/s3",
    "control_reversals": "1",
}


def _crossing(time: np.ndarray, signal: np.ndarray, level: float) -> float | None:
    """Return when the signal first reaches a level, between samples by a straight line."""
    above = np.nonzero(signal >= level)[0]
    if len(above) == 0:
        return None
    i = int(above[0])
    if i == 0:
        return float(time[0])
    share = (level - signal[i - 1]) / (signal[i] - signal[i - 1])
    return float(time[i - 1] + share * (time[i] - time[i - 1]))


def _inside_from(time: np.ndarray, error: np.ndarray, band: float) -> float | None:
    """Return from when on |error| stays within the band; None if not for the last 5 s at least."""
    outside = np.nonzero(np.abs(error) > band)[0]
    if len(outside) == 0:
        return float(time[0])
    i = int(outside[-1])
    if time[i] > time[-1] - FINAL:
        return None  # a limit cycle that happens to be inside when the run ends has not settled
    a, b = abs(error[i]), abs(error[i + 1])
    return float(time[i] + (a - band) / (a - b) * (time[i + 1] - time[i]))


def step_response(
    time: np.ndarray, signal: np.ndarray, reference: np.ndarray, *, start: float = 0.0
) -> Metrics:
    """Return the metrics of the reference's step from `start`, counted from when it happens (s).

    rise_time: from 10 to 90 % of the step; settling_time: from when on the error stays within
    2 % of it, for the last 5 s at least; overshoot: furthest value beyond it, in percent of the
    step; steady_state_error: mean of the error over the last 5 s, likewise; iae, itae: integrals
    of |e| and t·|e|. Without a step, or with one that does not stay, all are None.
    """
    target = float(reference[-1])
    height = target - start
    apart = np.nonzero(reference != target)[0]
    first = int(apart[-1]) + 1 if len(apart) else 0
    if height == 0.0 or first == len(time) or np.any(reference[:first] != start):
        names = ("rise_time", "settling_time", "overshoot", "steady_state_error", "iae", "itae")
        return dict.fromkeys(names)
    t, y = time[first:] - time[first], signal[first:]
    error, share = target - y, (y - start) / height
    low, high = (_crossing(t, share, level) for level in (0.1, 0.9))
    final = t >= t[-1] - FINAL
    return {
        "rise_time": None if low is None or high is None else high - low,
        "settling_time": _inside_from(t, error, BAND * abs(height)),
        "overshoot": max(0.0, 100.0 * float(np.max(share) - 1.0)),
        "steady_state_error": 100.0 * float(np.mean(error[final])) / height,
        "iae": float(np.trapezoid(np.abs(error), t)),
        "itae": float(np.trapezoid(t * np.abs(error), t)),
    }


def disturbance_response(
    time: np.ndarray, signal: np.ndarray, reference: np.ndarray, disturbance: np.ndarray
) -> Metrics:
    """Return the metrics of a disturbance, where it is not 0, at the reference's last value.

    dip: how far the signal falls below that target from the disturbance's start on, in percent;
    rebound: how far it rises above it after the end; recovery_time: from the end until the error
    stays within 2 %; iae: integral of |e| from the start on. Without a disturbance that ends, with
    a reference that still moves after it began, or a target of 0, all are None.
    """
    target = float(reference[-1])
    there = np.nonzero(disturbance != 0.0)[0]
    steady = len(there) > 0 and bool(np.all(reference[there[0] :] == target))
    if target == 0.0 or not steady or there[-1] == len(time) - 1:
        return dict.fromkeys(("dip", "rebound", "recovery_time", "iae"))
    start, end = int(there[0]), int(there[-1]) + 1
    error = target - signal
    inside = _inside_from(time[end:], error[end:], BAND * abs(target))
    return {
        "dip": 100.0 * float(np.max(error[start:] / target)),
        "rebound": max(0.0, -100.0 * float(np.min(error[end:] / target))),
        "recovery_time": None if inside is None else inside - float(time[end]),
        "iae": float(np.trapezoid(np.abs(error[start:]), time[start:])),
    }


def tracking(time: np.ndarray, signal: np.ndarray, reference: np.ndarray) -> Metrics:
    """Return rms_error and max_error of the error, and its iae, over a whole profile."""
    error = reference - signal
    return {
        "rms_error": float(np.sqrt(np.mean(error * error))),
        "max_error": float(np.max(np.abs(error))),
        "iae": float(np.trapezoid(np.abs(error), time)),
    }
