"""The braking model again: plain equations under scipy's integrator, with exact delays."""

import math
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

G = 9.81 / 1000.0


def davis(v: float) -> float:
    kmh = 3.6 * v
    return (2.031 + 0.0622 * kmh + 0.001807 * kmh * kmh) * G


class Reference:
    """Motion of a train whose commands are held for 0.2 s each, from equilibrium at t = 0."""

    def __init__(
        self,
        theta: tuple[float, ...],
        commands: tuple[float, ...],
        probe: tuple[float, float, float] = (0.0, math.inf, math.inf),
    ) -> None:
        (self.t1, self.t2, self.g, self.t3, self.t4, self.ke, self.v_sw, self.k_bra, self.approach,
         self.platform, self.factor, self.v0, self.s0, _) = theta  # fmt: skip
        self.commands = commands
        self.probe = probe  # level, begin and end
        self.equilibrium = self.resistance(self.v0, self.s0)
        self.onset = math.inf

    def resistance(self, v: float, s: float) -> float:
        share = min(max((s + 120.0) / 118.0, 0.0), 1.0)
        gradient = (1.0 - share) * self.approach + share * self.platform
        return self.factor * davis(v) + gradient

    def command(self, t: float) -> float:
        if t < 0.0:
            return self.equilibrium / self.g
        return self.commands[min(int(t / 0.2 + 1e-9), len(self.commands) - 1)]

    def rates(self, t: float, x: np.ndarray, middle: float) -> list[float]:
        s, v, e, p = x
        on = middle > self.onset
        w = max(0.0, 1.0 - self.k_bra * (t - self.onset) / 0.7) if on else 1.0
        kmh = 3.6 * v
        level, begin, end = self.probe
        asked = min(self.command(middle - self.t3), 0.0) if on else 0.0
        asked += level if begin < middle - self.t3 < end else 0.0
        air = self.ke * (kmh + 150.0) / (2.0 * kmh + 150.0) * asked
        return [
            v,
            w * e + p - self.resistance(v, s),
            (self.g * self.command(middle - self.t1) - e) / self.t2,
            (air - p) / self.t4,
        ]

    def run(self, times: np.ndarray) -> tuple[np.ndarray, float, float]:
        """Return (s, v) at the times; stop and stopping time, NaN if they are not reached."""
        t, x = 0.0, np.array([self.s0, self.v0, self.equilibrium, 0.0])
        shown = {0.0: x}
        edges = [0.2 * k + lag for k in range(len(self.commands)) for lag in (self.t1, self.t3)]
        edges += [b + self.t3 for b in self.probe[1:]]
        stops = sorted({*edges, *times.tolist()})

        def standstill(t: float, x: np.ndarray, *_: float) -> float:
            return x[1]

        def changeover(t: float, x: np.ndarray, *_: float) -> float:
            return x[1] - self.v_sw

        for one in (standstill, changeover):
            one.terminal, one.direction = True, -1.0  # pyright: ignore[reportFunctionMemberAccess]
        while t < times[-1]:
            extra = (self.onset, self.onset + 0.7 / self.k_bra)
            end = min(b for b in (*stops, *extra) if b > t + 1e-12)
            events = (standstill, changeover) if self.onset == math.inf else (standstill,)
            done = solve_ivp(
                self.rates, (t, end), x, args=(0.5 * (t + end),), events=events, rtol=1e-11,
                atol=1e-12,
            )  # fmt: skip
            t, x = float(done.t[-1]), done.y[:, -1]
            if len(done.t_events[0]):
                return self._at(times, shown, x), float(x[0]), t
            if len(events) > 1 and len(done.t_events[1]):
                self.onset = t + self.t3
            shown[t] = x
        return self._at(times, shown, None), math.nan, math.nan

    def _at(self, times: np.ndarray, shown: dict[float, np.ndarray], stop: object) -> np.ndarray:
        rows = [shown[t][:2] if t in shown else np.array([stop[0], 0.0]) for t in times]  # type: ignore[index]
        assert all(a < b for a, b in pairwise(times))
        return np.array(rows)
