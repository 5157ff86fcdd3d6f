"""Comfort of a ride and quiet of its control. The definitions stand in docs/results.md as well."""

import numpy as np

from .metrics import Metrics

JERK_WINDOW = 0.1  # s, over which acceleration is differenced
NAMES = ("max_acceleration", "rms_acceleration", "max_jerk", "rms_jerk", "control_reversals")


def comfort(
    time: np.ndarray, acceleration: np.ndarray, control: np.ndarray, *, swing: float
) -> Metrics:
    """Return the comfort metrics of a ride, from equally spaced rows.

    max_acceleration and rms_acceleration: of |a|; max_jerk, rms_jerk: of the change of a over a
    window of 0.1 s (or one row, if that is longer), divided by it, so that the figure does not
    depend on how often the rows come; control_reversals: how often the control turns round and
    then goes back by at least `swing`, in the control's unit. With less than three rows all are
    None.
    """
    if len(time) < 3:
        return dict.fromkeys(NAMES)
    spacing = (time[-1] - time[0]) / (len(time) - 1)
    rows = min(max(1, round(JERK_WINDOW / spacing)), len(time) - 1)
    jerk = (acceleration[rows:] - acceleration[:-rows]) / (rows * spacing)
    return {
        "max_acceleration": float(np.max(np.abs(acceleration))),
        "rms_acceleration": _rms(acceleration),
        "max_jerk": float(np.max(np.abs(jerk))),
        "rms_jerk": _rms(jerk),
        "control_reversals": float(reversals(control, swing)),
    }


def ride_to_standstill(standstill: np.ndarray) -> slice | None:
    """Return the rows up to the first of the last standstill, or None if the train moves on.

    `standstill` is 1 where the train stands. A train that never moved has no ride either.
    """
    moving = np.nonzero(standstill == 0)[0]
    if len(moving) == 0 or moving[-1] == len(standstill) - 1:
        return None
    return slice(0, int(moving[-1]) + 2)


def _rms(signal: np.ndarray) -> float:
    return float(np.sqrt(np.mean(signal * signal)))


def reversals(control: np.ndarray, swing: float) -> int:
    """Return how often a signal turns round and then goes back by at least `swing`.

    Smaller wiggles on the way do not count, as in hysteresis counting of load cycles.
    """
    count = 0
    direction = 0
    low = high = extreme = float(control[0])
    for value in control.tolist():
        if direction == 0:
            low, high = min(low, value), max(high, value)
            if high - low >= swing:
                direction = 1 if value == high else -1
                extreme = value
        elif (value - extreme) * direction >= 0.0:
            extreme = value
        elif (extreme - value) * direction >= swing:
            direction, extreme = -direction, value
            count += 1
    return count
