"""The precise model by scipy at 1e-11, piece by piece between all its jumps: logs without noise."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from railcosim.studies.identification.logs import Log

PERIOD = 0.2
ERROR = 1e-11


@dataclass(frozen=True, kw_only=True)
class Train:
    """Parameters in SI units, spelled as in the paper; `slope` in ‰."""

    T1: float = 0.9
    T2: float = 0.83
    P1: float = 0.85
    T3: float = 0.8
    T4: float = 1.741
    K: float = 0.8516
    V_sw: float = 12.0 / 3.6
    k_bra: float = 0.3
    mu: float = 1.0
    slope: float = 0.0

    def resistance(self, v: float) -> float:
        V = 3.6 * v
        return (2.031 + 0.0622 * V + 0.001807 * V * V + self.slope) * 9.81e-3


def command(kind: int, cruise: float, count: int) -> np.ndarray:
    """Return a braking command: cruising for 3 s, a ramp, and a shape of its own."""
    t = PERIOD * np.arange(count) - 3.0
    shape = (-0.8 - 0.1 * np.sin(0.7 * t), -0.7 - 0.015 * t, -0.95 + 0.01 * t)[kind % 3]
    late = np.where(t > 14.0, 0.15 * np.sign(np.sin(1.3 * t + kind)), 0.0)
    return np.where(t < 0.0, cruise, np.maximum(shape + late, -0.5 * t - 0.1))


def simulate(train: Train, u: np.ndarray, *, speed: float = 14.0) -> tuple[np.ndarray, float]:
    """Return speeds at the samples up to the stop, and when the air brake comes on."""
    end = PERIOD * (len(u) - 1)

    def held(t: float) -> float:
        return float(u[int(np.clip(np.floor(t / PERIOD + 1e-9), 0, len(u) - 1))])

    def pieces(onset: float) -> tuple[np.ndarray, np.ndarray]:
        jumps = PERIOD * np.arange(len(u))
        fade = 0.7 / train.k_bra
        edges = np.concatenate((jumps, jumps + train.T1, jumps + train.T3, [onset, onset + fade]))
        edges = np.unique(np.round(edges[(edges >= 0.0) & (edges <= end)], 12))
        x = np.array([speed, train.P1 * u[0] / train.mu, 0.0])
        found = [x]
        for a, b in pairwise(edges):
            middle = 0.5 * (a + b)
            electric, air = held(middle - train.T1), min(held(middle - train.T3), 0.0)
            on = middle >= onset

            def rates(t: float, y: np.ndarray, e=electric, p=air, on=on) -> list[float]:
                v, motors, brake = y
                w = min(max(1.0 - train.k_bra * (t - onset) / 0.7, 0.0), 1.0) if on else 1.0
                friction = (3.6 * v + 150.0) / (7.2 * v + 150.0)
                demand = train.K * friction * p / train.mu if on else 0.0
                return [
                    w * motors + brake - train.resistance(v),
                    (train.P1 * e / train.mu - motors) / train.T2,
                    (demand - brake) / train.T4,
                ]

            solved = solve_ivp(rates, (a, b), x, method="DOP853", rtol=ERROR, atol=ERROR)
            x = solved.y[:, -1]
            found.append(x)
            if x[0] < 0.0:
                return edges[: len(found)], np.array(found)
        return edges, np.array(found)

    edges, states = pieces(1e6)
    v = states[:, 0]
    i = int(np.argmax(v < train.V_sw))
    # The rate at an edge is that of both sides here: a cubic through values and rates
    share = np.roots(_hermite(edges, states, i, train))
    inside = share[np.isreal(share) & (share.real >= -1e-9) & (share.real <= 1.0 + 1e-9)].real
    onset = float(edges[i - 1] + inside[0] * (edges[i] - edges[i - 1])) + train.T3
    edges, states = pieces(onset)
    samples = PERIOD * np.arange(len(u))
    samples = samples[samples <= edges[-1] + 1e-9]
    return np.interp(samples, edges, states[:, 0]), onset


def _hermite(edges: np.ndarray, states: np.ndarray, i: int, train: Train) -> np.ndarray:
    h = edges[i] - edges[i - 1]
    (v0, m0, _), (v1, m1, _) = states[i - 1], states[i]
    d0, d1 = h * (m0 - train.resistance(v0)), h * (m1 - train.resistance(v1))
    return np.array(
        [2 * v0 + d0 - 2 * v1 + d1, -3 * v0 - 2 * d0 + 3 * v1 - d1, d0, v0 - train.V_sw]
    )


def log(train: Train, kind: int, *, flag: bool = True, noise: float = 0.0) -> tuple[Log, float]:
    """Return a log and the instant at which the air brake comes on."""
    cruise = train.resistance(14.0) * train.mu / train.P1
    u = command(kind, cruise, 220)
    speed, onset = simulate(train, u)
    # Every sample is an edge, so the interpolation is exact; the stop is shown as 0.
    time = PERIOD * np.arange(len(speed) + 5)
    speed = np.concatenate((np.maximum(speed, 0.0), np.zeros(5)))
    speed = speed + noise * np.random.default_rng(kind).standard_normal(len(speed))
    made = Log(
        name=f"kind{kind}", time=time, command=u[: len(time)], speed=speed,
        air_brake=time >= onset, gradient=np.full(len(time), train.slope),
    )  # fmt: skip
    return (made if flag else replace(made, air_brake=None)), onset
