"""The brakings in a log: from the first brake command to the stop."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.errors import FileError
from .logs import Log

STANDING = 0.1  # m/s; slower counts as stopped, above the noise of usual odometry
MOVING = 2.0  # m/s; a train that never was faster has not braked to a stop
BRAKES = -0.02  # m/s², of the command
PAUSE = 1.0  # s without brake command that end a braking; shorter ones belong to it
LEAD = 3.0  # s before the first brake command that are simulated too
SHORTEST = 2.0  # s of braking


@dataclass(frozen=True, kw_only=True, eq=False)
class Braking:
    """One braking to a stop, with some seconds before it.

    `time` (s, from the window's beginning), `speed` (m/s) and `gradient` (‰) at the samples;
    `counts` says which of them belong to the braking, the others lead up to it. `command` (m/s²)
    is held from each of `command_time` on; before the first one it was the same. `start_speed`
    is the speed at time 0. The air brake comes on at `onset`, if the log tells it.
    """

    name: str
    time: np.ndarray
    speed: np.ndarray
    gradient: np.ndarray
    counts: np.ndarray
    command_time: np.ndarray
    command: np.ndarray
    start_speed: float
    onset: float | None = None

    def passing(self, speed: float) -> tuple[float, float]:
        """Return when the measured speed (m/s) passes below a value, and how that time changes.

        Between samples by a straight line; s, and s per m/s. The measured speed is taken as the
        mean of five samples: noise would move the instant.
        """
        level, time = _smoothed(self.speed, self.time)
        falling = np.minimum.accumulate(level) - 1e-9 * np.arange(len(level))
        i = int(np.clip(np.searchsorted(-falling, -speed), 1, len(falling) - 1))
        slope = (time[i] - time[i - 1]) / (falling[i] - falling[i - 1])
        wide = slice(max(i - 3, 0), i + 3)  # over a second: the slope at noisy samples
        steady = np.polyfit(falling[wide], time[wide], 1)[0] if i >= 3 else slope
        return float(time[i - 1] + slope * (speed - falling[i - 1])), float(min(steady, 0.0))


def brakings(logs: Sequence[Log]) -> list[Braking]:
    """Return all brakings to a stop in some logs; raise FileError for a log without any."""
    return [braking for log in logs for braking in _of(log)]


def _of(log: Log) -> list[Braking]:
    stops = _stops(log)
    found: list[Braking] = []
    after = 0
    for stop in stops:
        first = _first(log, after, stop)
        if first is not None:
            name = log.name if len(stops) == 1 else f"{log.name}-{len(found) + 1}"
            found.append(_cut(log, name, after, first, stop))
        after = stop
    if not found:
        raise FileError(
            f"log '{log.name}' has a stop but no braking before it: {SHORTEST:g} s or more with a "
            f"command below {BRAKES:g} m/s2; negative commands brake"
        )
    return found


def _stops(log: Log) -> list[int]:
    """Return the samples at which the train has come to a stop."""
    standing = log.speed <= STANDING
    starts = np.flatnonzero(standing[1:] & ~standing[:-1]) + 1
    stops, after = [], 0
    for stop in map(int, starts):
        if np.max(log.speed[after:stop]) >= MOVING:
            stops.append(stop)
            after = stop
    if not stops:
        raise FileError(
            f"log '{log.name}' has no stop: its speed goes from {log.speed[0]:.2f} to "
            f"{log.speed[-1]:.2f} m/s, and never falls below {STANDING:g} m/s after having been "
            f"above {MOVING:g} m/s; use logs that end at standstill"
        )
    return stops


def _first(log: Log, after: int, stop: int) -> int | None:
    """Return the sample with the first brake command of the braking that ends at `stop`."""
    first, released = None, None
    for i in range(stop - 1, after - 1, -1):
        if log.command[i] < BRAKES:
            first, released = i, None
        elif first is not None:
            released = log.time[i + 1] if released is None else released
            if released - log.time[i] >= PAUSE - 1e-9:
                break
    if first is None or log.time[stop] - log.time[first] < SHORTEST:
        return None
    return first


def _cut(log: Log, name: str, after: int, first: int, stop: int) -> Braking:
    start = max(after, int(np.searchsorted(log.time, log.time[first] - LEAD - 1e-9)))
    window = slice(start, stop + 1)
    origin = log.time[start]
    time, speed = log.time[window] - origin, log.speed[window]
    history = max(after, int(np.searchsorted(log.time, origin - 10.0)))
    gradient = np.zeros(len(time)) if log.gradient is None else log.gradient[window]
    return Braking(
        name=name, time=time, speed=speed, gradient=gradient,
        counts=np.arange(start, stop + 1) >= first,
        command_time=log.time[history:stop + 1] - origin,
        command=log.command[history:stop + 1],
        start_speed=_start_speed(time[:first - start + 1], speed[:first - start + 1]),
        onset=_onset(log, name, start, first, stop),
    )  # fmt: skip


def _start_speed(time: np.ndarray, speed: np.ndarray) -> float:
    """Return the speed at time 0: by a straight line through what leads up to the braking."""
    if len(time) < 5:
        return float(speed[0])
    return float(np.polynomial.Polynomial.fit(time, speed, 1)(0.0))


def _onset(log: Log, name: str, start: int, first: int, stop: int) -> float | None:
    """Return when the air brake comes on: between the last sample off and the first one on."""
    if log.air_brake is None:
        return None
    on = log.air_brake[start : stop + 1]
    if log.air_brake[first]:
        raise FileError(
            f"log '{name}': the air brake is on already at {log.time[first]:g} s, where the "
            "braking begins; leave such a run out, or the column 'air_brake'"
        )
    rises = np.flatnonzero(on[1:] & ~on[:-1]) + 1
    if len(rises) == 0:
        raise FileError(
            f"log '{name}': the air brake does not come on before the stop at "
            f"{log.time[stop]:g} s; leave such a run out, or the column 'air_brake'"
        )
    k = start + int(rises[-1])
    return float(0.5 * (log.time[k - 1] + log.time[k]) - log.time[start])


def _smoothed(speed: np.ndarray, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    kernel = np.ones(5) / 5.0
    return np.convolve(speed, kernel, "valid"), np.convolve(time, kernel, "valid")
