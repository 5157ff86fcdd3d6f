"""Master algorithms once more, in numpy on linear halves whose steps are exact.

Nothing of railcosim is imported. Two halves drive each other: the inputs of one are the outputs of
the other. A half's step is the matrix exponential with its inputs along straight lines; an output
that feeds through shows, after a step, the input at the step's end, as an FMU's does.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.linalg import expm

Array = np.ndarray


@lru_cache(maxsize=4096)
def _transition(a: bytes, n: int, b: bytes, k: int, h: float) -> tuple[Array, Array, Array]:
    m = np.zeros((n + 2 * k, n + 2 * k))
    m[:n, :n] = np.frombuffer(a).reshape(n, n)
    m[:n, n : n + k] = np.frombuffer(b).reshape(n, k)
    m[n : n + k, n + k :] = np.eye(k)
    e = expm(m * h)
    return e[:n, :n], e[:n, n : n + k], e[:n, n + k :]


def linear_step(a: Array, b: Array, x: Array, u: Array, slope: Array, h: float) -> Array:
    """Return x after h of x' = a x + b (u + slope · t), exactly."""
    n, k = b.shape
    p, q, r = _transition(a.tobytes(), n, b.tobytes(), k, h)
    return p @ x + q @ u + r @ slope


@dataclass
class Half:
    """x' = a x + b u + r, y = c x + d u, of which `r` is what acts from outside."""

    a: Any
    b: Any
    c: Any
    d: Any
    x: Any
    r: Any = field(default_factory=lambda: np.zeros(2))

    def __post_init__(self) -> None:
        self.a, self.b, self.c, self.d, self.x, self.r = (
            np.ascontiguousarray(m, dtype=float)
            for m in (self.a, self.b, self.c, self.d, self.x, self.r)
        )
        self.with_outside = np.column_stack([self.b, self.r])

    def after(self, h: float, u: Array, end: Array) -> tuple[Array, Array]:
        """Return state and outputs after a step with the inputs on the line from u to end."""
        slope = np.append((end - u) / h, 0.0)
        x = linear_step(self.a, self.with_outside, self.x, np.append(u, 1.0), slope, h)
        return x, self.c @ x + self.d @ end


def oscillator() -> tuple[Half, Half]:
    """The two-mass oscillator: a mass that takes a force, and one that gives it."""
    m, c, d, ck, dk = 1.0, 10.0, 0.1, 100.0, 1.0
    one = Half(
        [[0, 1], [-c / m, -d / m]], [[0], [1 / m]], np.eye(2), np.zeros((2, 1)), [1, 0]
    )  # fmt: skip
    two = Half(
        [[0, 1], [-(c + ck) / m, -(d + dk) / m]], [[0, 0], [ck / m, dk / m]],
        [[ck, dk]], [[-ck, -dk]], [0, 0],
    )  # fmt: skip
    return one, two


def quarter_car(*, road: float, wheel: Array, chassis: Array) -> tuple[Half, Half]:
    """A wheel that takes the suspension's force, a chassis with suspension that gives it."""
    m1, k1, m2, k2, d2 = 40.0, 150e3, 400.0, 15e3, 1e3
    one = Half(
        [[0, 1], [-k1 / m1, 0]], [[0], [1 / m1]], np.eye(2), np.zeros((2, 1)), wheel,
        np.array([0, k1 / m1 * road]),
    )  # fmt: skip
    two = Half(
        [[0, 1], [-k2 / m2, -d2 / m2]], [[0, 0], [k2 / m2, d2 / m2]],
        [[k2, d2]], [[-k2, -d2]], chassis,
    )  # fmt: skip
    return one, two


def whole(halves: tuple[Half, Half], times: Array) -> Array:
    """Return the states of both, at ascending times, solved as one system.

    Only the second may feed through.
    """
    one, two = halves
    assert not one.d.any()
    n1, n2 = len(one.x), len(two.x)
    m = np.zeros((n1 + n2 + 1, n1 + n2 + 1))
    m[:n1, :n1] = one.a + one.b @ two.d @ one.c
    m[:n1, n1 : n1 + n2] = one.b @ two.c
    m[n1 : n1 + n2, :n1] = two.b @ one.c
    m[n1 : n1 + n2, n1 : n1 + n2] = two.a
    m[:n1, -1], m[n1 : n1 + n2, -1] = one.r, two.r
    rows = [np.concatenate([one.x, two.x, [1.0]])]
    transitions: dict[float, Array] = {}
    for span in np.diff(times, prepend=0.0):
        key = round(float(span), 14)  # s; equal steps differ by rounding alone
        if key not in transitions:
            transitions[key] = expm(m * key)
        rows.append(transitions[key] @ rows[-1])
    return np.array(rows)[1:, :-1]


# The algorithms: each yields the rows of states and the second half's output at 0, h, 2 h, …


def _start(halves: tuple[Half, Half]) -> list[Array]:
    one, two = halves
    first = one.c @ one.x
    return [first, two.c @ two.x + two.d @ first]


def _run(halves: tuple[Half, Half], h: float, count: int, tick: Callable) -> Array:
    y, last = _start(halves), None
    rows = [np.concatenate([halves[0].x, halves[1].x, y[1]])]
    for _ in range(count):
        rate = [np.zeros_like(v) for v in y] if last is None else [
            (v - w) / h for v, w in zip(y, last, strict=True)
        ]  # fmt: skip
        last, y = y, tick(y, rate)
        rows.append(np.concatenate([halves[0].x, halves[1].x, y[1]]))
    return np.array(rows)


def parallel(halves: tuple[Half, Half], h: float, count: int, order: int) -> Array:
    """Jacobi: both from the outputs at t_k, extrapolated with order 0 or 1."""

    def tick(y: list[Array], rate: list[Array]) -> list[Array]:
        ahead = [v + order * h * s for v, s in zip(y, rate, strict=True)]
        ends = [halves[i].after(h, y[1 - i], ahead[1 - i]) for i in (0, 1)]
        for half, (x, _) in zip(halves, ends, strict=True):
            half.x = x
        return [end for _, end in ends]

    return _run(halves, h, count, tick)


def parallel_with_outside_coupling(
    halves: tuple[Half, Half], h: float, count: int, order: int
) -> Array:
    """Jacobi, the coupling's force computed at t_k from what both show then."""

    def tick(y: list[Array], rate: list[Array]) -> list[Array]:
        ahead = [v + order * h * s for v, s in zip(y, rate, strict=True)]
        states = [halves[i].after(h, y[1 - i], ahead[1 - i])[0] for i in (0, 1)]
        for half, x in zip(halves, states, strict=True):
            half.x = x
        return _start(halves)

    return _run(halves, h, count, tick)


def in_order(halves: tuple[Half, Half], h: float, count: int, order: int, first: int = 0) -> Array:
    """Gauss–Seidel: one half steps, the other reads its outputs at t_{k+1}."""
    second = 1 - first

    def tick(y: list[Array], rate: list[Array]) -> list[Array]:
        new: list[Array] = [*y]
        ahead = y[second] + order * h * rate[second]
        halves[first].x, new[first] = halves[first].after(h, y[second], ahead)
        begin = y[first] if order else new[first]
        halves[second].x, new[second] = halves[second].after(h, begin, new[first])
        return new

    return _run(halves, h, count, tick)


def iterated(halves: tuple[Half, Half], h: float, count: int, order: int) -> Array:
    """Outputs and inputs agree at t_{k+1}; inputs are held at that, or a line to it."""

    def tick(y: list[Array], rate: list[Array]) -> list[Array]:
        sizes = [len(v) for v in y]

        def ends(z: Array) -> list[tuple[Array, Array]]:
            goal = np.split(z, [sizes[0]])
            begin = y if order else goal
            return [halves[i].after(h, begin[1 - i], goal[1 - i]) for i in (0, 1)]

        def residual(z: Array) -> Array:
            return np.concatenate([end for _, end in ends(z)]) - z

        z = np.concatenate(y)
        for _ in range(2):  # linear: the second time against rounding
            base = residual(z)
            slopes = np.array([residual(z + e) - base for e in np.eye(len(z))]).T
            z = z - np.linalg.solve(slopes, base)
        for half, (x, _) in zip(halves, ends(z), strict=True):
            half.x = x
        return np.split(z, [sizes[0]])

    return _run(halves, h, count, tick)


# Delays


def retarded(gain: float, h: float, steps: int, count: int, *, linear: bool) -> Array:
    """x' = −gain · x(t − steps · h), history 1, the input held or a line from sample to sample."""
    x = np.ones(steps + count + 1)
    for k in range(steps, steps + count):
        delayed = 0.5 * (x[k - steps] + x[k - steps + 1]) if linear else x[k - steps]
        x[k + 1] = x[k] - gain * h * delayed
    return x[steps:]


def stability_boundary(h: float, steps: int, *, linear: bool) -> float:
    """Return the gain at which the largest root of the loop's polynomial has size 1."""
    low, high = 1.3, 1.7
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        p = np.zeros(steps + 2)
        p[:2] = 1.0, -1.0
        if linear:
            p[-2:] += 0.5 * middle * h
        else:
            p[-1] += middle * h
        inside = np.max(np.abs(np.roots(p))) < 1.0 + 1e-12
        low, high = (middle, high) if inside else (low, middle)
    return 0.5 * (low + high)


def held_boundary(h: float, steps: int) -> float:
    """Return the same for held input in closed form."""
    return 2.0 / h * math.sin(math.pi / (2.0 * (2 * steps + 1)))


def delayed_oscillator(h: float, steps: int, count: int, *, ck: float) -> Array:
    """The oscillator, its force reaching the first mass `steps` samples late, a line between them.

    Over a step the force is known, and so the second mass just follows the first: exact but for
    the lines. Rows are x1, v1, x2, v2.
    """
    c, d, dk = 10.0, 0.1, 1.0
    a = np.array(
        [[0, 1, 0, 0], [-c, -d, 0, 0], [0, 0, 0, 1], [ck, dk, -(c + ck), -(d + dk)]], float
    )
    b = np.array([[0.0], [1.0], [0.0], [0.0]])
    force = np.array([-ck, -dk, ck, dk])
    rows = [np.array([1.0, 0.0, 0.0, 0.0])]
    for k in range(count):
        ends = [force @ rows[i] if i >= 0 else 0.0 for i in (k - steps, k - steps + 1)]
        if k + 1 == steps:
            ends[1] = 0.0  # the history ends with a jump
        u, slope = np.array(ends[:1]), np.array([(ends[1] - ends[0]) / h])
        rows.append(linear_step(a, b, rows[-1], u, slope, h))
    return np.array(rows)
