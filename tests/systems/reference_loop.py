"""The soft-switching loop once more, from the study sheet alone.

Nothing of railcosim is imported: plant, controllers, rule tables, inference and loop are retyped.
The plant is propagated by scipy's matrix exponential between the controller's samples; the centre
of gravity is integrated by Simpson's rule over the outline's linear pieces, where it is exact.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm

T1 = [[-3,-3,-2,-2,-1,-1,0],[-3,-2,-2,-1,-1,0,1],[-2,-2,-1,-1,0,1,1],[-2,-1,-1,0,1,1,2],
      [-1,-1,0,1,1,2,2],[-1,0,1,1,2,2,3],[0,1,1,2,2,3,3]]  # fmt: skip
T2 = [[3,3,2,2,1,1,0],[3,2,2,1,1,0,-1],[3,2,1,1,0,0,-1],[2,2,1,0,0,-1,-2],
      [1,1,0,0,-1,-2,-2],[1,0,-1,-1,-2,-2,-3],[0,-1,-1,-2,-2,-3,-3]]  # fmt: skip
T3 = [[1,1,1,1,0],[1,1,1,0,0],[1,0,0,0,0],
      [0,0,0,0,1],[0,0,0,1,1],[0,1,1,1,1]]  # fmt: skip


def memberships(value: float, low: float, high: float, count: int) -> np.ndarray:
    peaks = np.linspace(low, high, count)
    value = min(max(value, low), high)
    return np.maximum(0.0, 1.0 - np.abs(value - peaks) / ((high - low) / (count - 1)))


def centre_of_gravity(heights: np.ndarray, low: float, high: float) -> float:
    count = len(heights)
    peaks, width = np.linspace(low, high, count), (high - low) / (count - 1)

    def outline(y: np.ndarray) -> np.ndarray:
        shapes = np.maximum(0.0, 1.0 - np.abs(y[:, np.newaxis] - peaks) / width)
        return np.max(np.minimum(shapes, heights), axis=1)

    # Kinks: peaks, where a flank meets its own or its neighbour's height, where flanks cross.
    left, right, own, next_one = peaks[:-1], peaks[1:], heights[:-1], heights[1:]
    meets = [left + own * width, left + next_one * width]
    meets += [right - own * width, right - next_one * width]
    kinks = np.sort(np.concatenate([peaks, left + 0.5 * width, *meets]))
    a, b = kinks[:-1], kinks[1:]
    m = 0.5 * (a + b)
    at_kinks, fm = np.split(outline(np.concatenate([kinks, m])), [len(kinks)])
    fa, fb = at_kinks[:-1], at_kinks[1:]
    sixth = (b - a) / 6.0
    area = float(sixth @ (fa + 4.0 * fm + fb))
    moment = float(sixth @ (a * fa + 4.0 * m * fm + b * fb))
    return moment / area


def mamdani(table, ec: float, e: float, universes) -> float:
    (ec_low, ec_high), (e_low, e_high), (low, high) = universes
    rows = memberships(ec, ec_low, ec_high, 7)
    columns = memberships(e, e_low, e_high, 7)
    return centre_of_gravity(heights_of(table, rows, columns, 7, lowest=-3), low, high)


def heights_of(
    table: list[list[int]], rows: np.ndarray, columns: np.ndarray, count: int, *, lowest: int = 0
) -> np.ndarray:
    """Return how far each of `count` output terms is met: max of min over the table's cells."""
    heights = np.zeros(count)
    for i in np.nonzero(rows)[0]:
        for j in np.nonzero(columns)[0]:
            k = table[i][j] - lowest
            heights[k] = max(heights[k], min(rows[i], columns[j]))
    return heights


def limit(u: float) -> float:
    return min(max(u, -10.0), 10.0)


@dataclass
class Errors:
    """e(k), e(k−1), e(k−2); at the first sample the earlier ones are e(0), or 0 if literal."""

    literal: bool
    e1: float | None = None
    e2: float = 0.0

    def take(self, e: float) -> tuple[float, float]:
        if self.e1 is None:
            self.e1 = self.e2 = 0.0 if self.literal else e
        pair = (self.e1, self.e2)
        self.e1, self.e2 = e, self.e1
        return pair


@dataclass
class Pid:
    kp: float
    ti: float
    td: float
    tf: float
    kick: bool = False
    ts: float = 0.05
    integral: float = 0.0
    d: float = 0.0
    last: float | None = None

    def __call__(self, e: float) -> float:
        if self.last is None:
            self.last = 0.0 if self.kick else e
        self.d = (self.tf * self.d + self.kp * self.td * (e - self.last)) / (self.tf + self.ts)
        self.last = e
        before, self.integral = self.integral, self.integral + self.ts * self.kp / self.ti * e
        wanted = self.kp * e + self.integral + self.d
        if limit(wanted) != wanted:
            self.integral = before
        return limit(wanted)


@dataclass
class Fuzzy:
    literal: bool = False
    ts: float = 0.05
    errors: Errors = field(init=False)

    def __post_init__(self) -> None:
        self.errors = Errors(self.literal)

    def __call__(self, e: float) -> float:
        e1, _ = self.errors.take(e)
        ec = (e - e1) if self.literal else (e - e1) / self.ts
        u = mamdani(T1, 3.0 * ec, 0.4 * e, ((-3, 3), (-0.6, 0.6), (-10, 10)))
        return limit(5.0 * u)


@dataclass
class Neuron:
    literal: bool = False
    tuned: bool = True
    ts: float = 0.05
    u: float = 0.0
    weights: np.ndarray = field(default_factory=lambda: np.array([0.1, 0.1, 0.1]))
    errors: Errors = field(init=False)

    def __post_init__(self) -> None:
        self.errors = Errors(self.literal)

    def __call__(self, e: float) -> float:
        e1, e2 = self.errors.take(e)
        de, dde = e - e1, e - 2.0 * e1 + e2
        rates = np.array([7.5, 18.2, 12.0])
        self.weights = self.weights + rates * (e * self.u * (e + de))
        if not self.literal:
            self.weights = np.maximum(self.weights, 0.1)
        shares = self.weights / np.sum(np.abs(self.weights))
        ec = de if self.literal else de / self.ts
        gain = 0.9
        if self.tuned:
            gain = max(0.01, 0.9 + mamdani(T2, ec, e, ((-1, 1), (-1, 1), (0, 3))))
        x = np.array([e, de, dde]) if self.literal else np.array([self.ts * e, de, dde / self.ts])
        self.u = limit(self.u + (1.0 if self.literal else 5.0) * gain * float(shares @ x))
        return self.u


@dataclass
class Composite:
    literal: bool = False
    ts: float = 0.05

    def __post_init__(self) -> None:
        self.fuzzy = Fuzzy(self.literal, self.ts)
        self.neuron = Neuron(self.literal, True, self.ts)
        self.errors = Errors(self.literal)

    def __call__(self, e: float) -> float:
        e1, _ = self.errors.take(e)
        ec = (e - e1) if self.literal else (e - e1) / self.ts
        weights = np.minimum.outer(memberships(e, -1, 1, 6), memberships(ec, -1, 1, 5))
        cf = float(np.sum(weights * np.array(T3)) / np.sum(weights))
        return cf * self.fuzzy(e) + (1.0 - cf) * self.neuron(e)


def closed_loop(
    controller: Callable[[float], float],
    *,
    ts: float = 0.05,
    stop: float = 60.0,
    reference: Callable[[float], float] = lambda t: 1.0,
    disturbance: Callable[[float], float] = lambda t: 0.0,
    gain: float = 2.2,
    wn: float = 0.18,
    delay_samples: int = 0,
    speed: float = 0.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times, speed and control at the controller's samples.

    The reference is read at the sample; disturbance and delayed control are held over the period.
    """
    m = np.zeros((3, 3))
    m[0, 1], m[1, 0] = 1.0, -wn * wn
    m[1, 1], m[1, 2] = -2.0 * 1.21 * wn, gain * wn * wn
    transition = expm(m * ts)
    x, sent = np.array([speed, 0.0]), []
    rows = []
    for k in range(round(stop / ts) + 1):
        t = k * ts
        u = controller(reference(t) - float(x[0]))
        sent.append(u)
        rows.append((t, x[0], u))
        acting = sent[k - delay_samples] if k >= delay_samples else 0.0
        x = (transition @ np.array([x[0], x[1], acting + disturbance(t)]))[:2]
    t, y, u = np.array(rows).T
    return t, y, u
