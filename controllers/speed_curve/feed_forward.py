"""The commands that drive a train with known brakes along a speed curve."""

import math
from dataclasses import dataclass, fields

import numpy as np
from scipy.optimize import lsq_linear

from ...base.errors import ParameterError
from .curve import SpeedCurve
from .driving import Course

GRID = 0.05  # s, on which the air brake's part is fitted
BEFORE = 3.0  # s before the changeover: from there on the commands are fitted
SPEED, PLACE = 2.0, 2.0  # weights of the speed's and the position's errors beside it
SMOOTH = 1e-2  # weight of the commands' second differences beside the acceleration's error


@dataclass(frozen=True, kw_only=True)
class Response:
    """How a metro train answers commands (m/s²), as the control reckons with; paper, table 1.

    Motors: T2 B' = P1 u(t − T1) − B. Air brake, from T3 after the changeover at V_sw on:
    T4 B' = K φ(v) min(u(t − T3), 0) − B; the motors then fade by fade_rate/fade_reference each
    second. Times in s, speeds in m/s. Raise ParameterError for a number that is not positive.
    """

    electric_delay: float = 0.9
    electric_lag: float = 0.83
    electric_coefficient: float = 0.85
    air_delay: float = 0.8
    air_lag: float = 1.741
    air_gain: float = 1.0142 / 0.01191 / 100.0
    changeover_speed: float = 12.0 / 3.6
    fade_rate: float = 0.3
    fade_reference: float = 0.7

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not 0.0 < value < math.inf:
                raise ParameterError(f"response: {field.name} must be positive, but is {value}")

    def friction(self, speed: np.ndarray) -> np.ndarray:
        """Return φ = (V + 150)/(2 V + 150), V in km/h: the brake shoes' friction over the speed."""
        v = 3.6 * speed
        return (v + 150.0) / (2.0 * v + 150.0)

    def share(self, since: np.ndarray) -> np.ndarray:
        """Return the motors' share at times (s) since the air brake came on."""
        return np.clip(1.0 - self.fade_rate / self.fade_reference * since, 0.0, 1.0)


def feed_forward(
    curve: SpeedCurve,
    course: Course,
    response: Response,
    *,
    lead: float,
    period: float,
    limits: tuple[float, float],
) -> tuple[float, ...]:
    """Return the command (m/s²) of each sample, one period (s) apart, from `lead` (s) before on.

    Before the changeover the motors' lag and delay are inverted exactly at the samples. From
    shortly before it on, the commands are those within `limits` whose acceleration comes nearest
    to the curve's in the least squares (with a little weight on being smooth), as two brakes with
    different lags answer one command. Raise ParameterError for a curve that stays below the
    changeover.
    """
    count = math.ceil((lead + curve.running_time) / period) + 1
    starts = period * np.arange(count) - lead  # when each command is given, on the curve's clock
    at = curve.at(starts + response.electric_delay)
    wanted = np.where(
        at.time > 0.0, at.acceleration + course.resistance(at.speed, at.position), 0.0
    )
    stay = math.exp(-period / response.electric_lag)
    after = np.append(wanted[1:], wanted[-1])
    commands = (after - stay * wanted) / (1.0 - stay) / response.electric_coefficient
    commands = np.clip(commands, *limits)

    fast = np.flatnonzero(curve.speed > response.changeover_speed)
    if len(fast) == 0:
        raise ParameterError(
            f"the curve stays below the changeover at {response.changeover_speed:.2f} m/s; "
            "there is no electric braking to hand over from"
        )
    last = int(fast[-1])
    onset = _reached(curve, last, response.changeover_speed) + response.air_delay
    first = int(np.searchsorted(starts, onset - response.air_delay - BEFORE))
    grid = np.arange(starts[first] + response.air_delay, curve.running_time, GRID)
    matrix = _answers(grid, starts, period, response, onset, curve)
    aim = curve.at(grid)
    rest = aim.acceleration + course.resistance(aim.speed, aim.position)
    rest = rest - matrix[:, :first] @ commands[:first]
    smooth = SMOOTH * np.diff(np.eye(count - first), 2, axis=0) / GRID
    rows = weighted(matrix[:, first:])
    found = lsq_linear(
        np.vstack([*rows, smooth]),
        np.concatenate([*weighted(rest), np.zeros(len(smooth))]),
        (limits[0], 0.0),
    )
    commands[first:] = found.x
    return tuple(commands.tolist())


def weighted(acceleration: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return an acceleration on the grid, and what speed and position change by it, weighted."""
    speed = GRID * (np.cumsum(acceleration, axis=0) - acceleration / 2.0)
    return acceleration, SPEED * speed, PLACE * GRID * np.cumsum(speed, axis=0)


def _reached(curve: SpeedCurve, span: int, speed: float) -> float:
    """Return when (s) the speed comes down to a value within the spans from `span` on."""
    times = np.linspace(curve.time[span], curve.time[span + 1], 1001)
    return float(times[np.argmax(curve.at(times).speed <= speed)])


def _answers(
    times: np.ndarray,
    starts: np.ndarray,
    period: float,
    response: Response,
    onset: float,
    curve: SpeedCurve,
) -> np.ndarray:
    """Return the acceleration at times (s) by a command of 1 over each period from its start on."""

    def risen(since: np.ndarray, lag: float) -> np.ndarray:
        return -np.expm1(-np.maximum(since, 0.0) / lag)

    since = times[:, None] - starts
    electric = since - response.electric_delay
    motors = risen(electric, response.electric_lag) - risen(
        electric - period, response.electric_lag
    )
    motors *= response.electric_coefficient * response.share(times - onset)[:, None]
    begin = np.maximum(starts + response.air_delay, onset)
    end = np.maximum(starts + period + response.air_delay, onset)
    friction = response.friction(curve.at((begin + end) / 2.0).speed)
    air = risen(times[:, None] - begin, response.air_lag) - risen(
        times[:, None] - end, response.air_lag
    )
    return motors + response.air_gain * friction * air
