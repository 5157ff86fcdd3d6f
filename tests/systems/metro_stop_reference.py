"""A metro stop computed apart from the package: equations, delays and events, by hand.

Runge and Kutta's fourth order in steps of at most 20 ms that end at every edge of a delayed
command, at the air brake's onset and where the electric brake has gone; the changeover and the
stop are found by Brent's method on the step's length. It shares no code with plants, delays,
diagrams or controllers.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from scipy.optimize import brentq

PERIOD = 0.2
State = tuple[float, float, float, float]  # position, speed, electric and air brake
Command = Callable[[int, float, float], float]  # sample, position, speed -> command


@dataclass(frozen=True, kw_only=True)
class Numbers:
    """Of a train and a station; names as in the precise braking paper, SI, gradients in ‰."""

    t1: float = 0.9
    t2: float = 0.83
    p1: float = 0.85
    mu: float = 1.0
    t3: float = 0.8
    t4: float = 1.741
    k: float = 1.0142 / 1.191
    v_sw: float = 6.0 / 3.6
    k_bra: float = 0.6
    davis: tuple[float, float, float] = (2.031, 0.0622, 0.001807)
    approach: float = 0.0
    platform: float = 0.0
    speed: float = 14.0
    start: float = -200.0
    inner: float = 0.02

    def resistance(self, s: float, v: float) -> float:
        a, b, c = self.davis
        share = min(max((s + 120.0) / 118.0, 0.0), 1.0)
        slope = self.approach + (self.platform - self.approach) * share
        return (a + b * 3.6 * v + c * (3.6 * v) ** 2 + slope) * 9.81 / 1000.0

    def rates(
        self, t: float, x: State, electric: float, air: float, onset: float, on: bool
    ) -> State:
        s, v, b_e, b_p = x
        w = max(0.0, 1.0 - self.k_bra * (t - onset) / 0.7) if on else 1.0
        phi = (3.6 * v + 150.0) / (2.0 * 3.6 * v + 150.0)
        limit = min(280e3, 2.8e6 / max(v, 0.1)) / 240e3
        wanted = self.k * phi * min(air, 0.0) / self.mu if on else 0.0
        return (
            v,
            w * b_e + b_p - self.resistance(s, v),
            (min(self.p1 * electric / self.mu, limit) - b_e) / self.t2,
            (wanted - b_p) / self.t4,
        )


def moved(x: State, h: float, rates: State) -> State:
    return (
        x[0] + h * rates[0], x[1] + h * rates[1], x[2] + h * rates[2], x[3] + h * rates[3]
    )  # fmt: skip


class Stop:
    """One stop: `position` (m) and `time` (s) of the standstill, states and commands by sample."""

    def __init__(self, numbers: Numbers, command: Command, *, longest: float = 60.0) -> None:
        self._n = numbers
        r = numbers.resistance(-1e6, numbers.speed)
        self._before = r * numbers.mu / numbers.p1
        self._x: State = (numbers.start, numbers.speed, r, 0.0)
        self._onset = math.inf
        self.position = self.time = math.nan
        self.states: list[State] = []
        self.commands: list[float] = []
        for k in range(round(longest / PERIOD)):
            self.states.append(self._x)
            self.commands.append(command(k, self._x[0], self._x[1]))
            if self._sample(k):
                break

    def _sample(self, k: int) -> bool:
        """Move over one period; return whether the train has stopped."""
        n, t, end = self._n, k * PERIOD, (k + 1) * PERIOD
        while end - t > 1e-12:
            edges = [(j * PERIOD + d) for d in (n.t1, n.t3) for j in range(k - 12, k + 2)]
            edges += [self._onset, self._onset + 0.7 / n.k_bra, end, t + n.inner]
            step = min(e - t for e in edges if e - t > 1e-12)
            before = self._x
            self._x = self._step(before, t, step)
            if math.isinf(self._onset) and self._x[1] <= n.v_sw:
                crossing = 0.0
                if before[1] > n.v_sw:
                    crossing = self._root(before, t, step, n.v_sw)
                self._onset = t + crossing + n.t3
            if self._x[1] <= 0.0:
                last = self._root(before, t, step, 0.0)
                self.position, self.time = self._step(before, t, last)[0], t + last
                return True
            t += step
        return False

    def _root(self, x: State, t: float, step: float, speed: float) -> float:
        found: Any = brentq(lambda h: self._step(x, t, h)[1] - speed, 0.0, step, xtol=1e-14)
        return found

    def _held(self, t: float, delay: float) -> float:
        k = math.floor((t - delay) / PERIOD)
        return self._before if k < 0 else self.commands[k]

    def _step(self, x: State, t: float, h: float) -> State:
        middle = t + 0.5 * h
        electric, air = (self._held(middle, d) for d in (self._n.t1, self._n.t3))
        on = middle > self._onset

        def rates(time: float, y: State) -> State:
            return self._n.rates(time, y, electric, air, self._onset, on)

        k1 = rates(t, x)
        k2 = rates(middle, moved(x, 0.5 * h, k1))
        k3 = rates(middle, moved(x, 0.5 * h, k2))
        k4 = rates(t + h, moved(x, h, k3))
        mean = [
            (a + 2.0 * b + 2.0 * c + d) / 6.0 for a, b, c, d in zip(k1, k2, k3, k4, strict=True)
        ]
        return moved(x, h, (mean[0], mean[1], mean[2], mean[3]))


def smarc(
    *, c: float, k_s: float, eta: float, lam: float, approach: float, start: float
) -> Command:
    """Return a SMARC with the sign function on the default target curve, all written anew."""
    theta = [1.0 / 0.85]
    last = [(2.031 + 0.0622 * 50.4 + 0.001807 * 50.4**2 + approach) * 9.81e-3 / 0.85]
    # Jerk -0.5 for 1.4 s from t = 2, then 18.6 s at -0.7, then +0.5 for 1.4 s: integrated piece
    # by piece from the start.
    pieces = ((2.0, 0.0), (1.4, -0.5), (18.6, 0.0), (1.4, 0.5))

    def curve(t: float) -> tuple[float, float, float]:
        x, v, a = start, 14.0, 0.0
        for length, jerk in pieces:
            h = min(max(t, 0.0), length)
            x += h * (v + h * (a / 2.0 + h * jerk / 6.0))
            v += h * (a + h * jerk / 2.0)
            a += h * jerk
            t -= length
        return x, v, a

    def command(k: int, s: float, v: float) -> float:
        x_d, v_d, a_d = curve(k * PERIOD)
        e, rate = s - x_d, v - v_d
        z = c * e + rate
        share = min(max((s + 120.0) / 118.0, 0.0), 1.0)
        slope = approach * (1.0 - share)
        big_v = 3.6 * v
        r = (2.031 + 0.0622 * big_v + 0.001807 * big_v**2 + slope) * 9.81e-3
        q = a_d - c * rate + r
        u = theta[0] * q - k_s * z - eta * math.copysign(1.0, z)
        theta[0] = min(max(theta[0] - PERIOD * lam * z * q, 0.8), 1.7)
        u = min(max(u, -1.0), 0.5)
        if v < 1.0:
            u = min(u, -0.15)
        if v < 0.25:
            u = last[0]
        last[0] = u
        return u

    return command
