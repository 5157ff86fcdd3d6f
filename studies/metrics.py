"""Metrics of a response. The definitions stand in docs/metrics.md as well."""

import numpy as np

BAND = 0.02  # of the step: settled
FINAL = 5.0  # s at the end: the steady-state error's mean, and the least stay in the band

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


def step_response(time: np.ndarray, signal: np.ndarray, target: float) -> dict[str, float | None]:
    """Return the metrics of a step from 0 to `target` at the first time (s).

    rise_time: from 10 to 90 % of the target; settling_time: from when on the error stays within
    2 % of it, for the last 5 s at least; overshoot: highest value above it, in percent;
    steady_state_error: mean of target − signal over the last 5 s, in percent; iae, itae:
    integrals of |e| and t·|e|.
    """
    error = target - signal
    t = time - time[0]
    low, high = (_crossing(t, signal / target, level) for level in (0.1, 0.9))
    final = t >= t[-1] - FINAL
    return {
        "rise_time": None if low is None or high is None else high - low,
        "settling_time": _inside_from(t, error, BAND * abs(target)),
        "overshoot": max(0.0, 100.0 * float(np.max(signal / target) - 1.0)),
        "steady_state_error": 100.0 * float(np.mean(error[final])) / target,
        "iae": float(np.trapezoid(np.abs(error), t)),
        "itae": float(np.trapezoid(t * np.abs(error), t)),
    }


def disturbance_response(
    time: np.ndarray, signal: np.ndarray, target: float, start: float, end: float
) -> dict[str, float | None]:
    """Return the metrics of a disturbance between two times (s) at a steady target.

    dip: how far the signal falls below the target after `start`, in percent; rebound: how far it
    rises above it after `end`; recovery_time: from `end` until the error stays within 2 %;
    iae: integral of |e| from `start` on.
    """
    hit, gone = time >= start, time >= end
    error = target - signal
    inside = _inside_from(time[gone], error[gone], BAND * abs(target))
    return {
        "dip": 100.0 * float(np.max(error[hit])) / target,
        "rebound": max(0.0, -100.0 * float(np.min(error[gone])) / target),
        "recovery_time": None if inside is None else max(0.0, inside - end),
        "iae": float(np.trapezoid(np.abs(error[hit]), time[hit])),
    }


def tracking(
    time: np.ndarray, signal: np.ndarray, reference: np.ndarray
) -> dict[str, float | None]:
    """Return rms_error and max_error of the error, and its iae, over a whole profile."""
    error = reference - signal
    return {
        "rms_error": float(np.sqrt(np.mean(error * error))),
        "max_error": float(np.max(np.abs(error))),
        "iae": float(np.trapezoid(np.abs(error), time)),
    }
