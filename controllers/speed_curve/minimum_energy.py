"""The target speed curve that takes the least energy at a given running time."""

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...base.errors import ConvergenceError, ParameterError
from ...base.railway import GRAVITY_PER_MILLE
from .curve import SpeedCurve
from .driving import Course, Driving
from .fast import fast_curve, timed_curve
from .regimes import regimes

if TYPE_CHECKING:
    from ...models.line import Section, Train

KINK = 1.0  # m, over which a limit's beginning is rounded, downwards
# What may happen between the nodes is kept out by margins, tried in this order: m/s below limits
# that change, and a share of the traction.
MARGINS = ((0.06, 3e-4), (0.12, 2e-3), (0.3, 6e-3))
QUIET = {
    "print_time": False,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "tol": 1e-8,
        "max_iter": 500,
        "bound_relax_factor": 0.0,
        "mu_strategy": "adaptive",
    },
}


def minimum_energy_curve(
    section: "Section",
    train: "Train",
    driving: Driving | None = None,
    *,
    time: float,
    node: float = 0.5,
) -> SpeedCurve:
    """Return the curve that takes the least traction energy for a running time (s).

    The unknowns are position, speed and acceleration at nodes at most `node` (s) apart, with
    constant jerk between them, so that the motion is exact and bounds on acceleration and jerk
    hold everywhere. ∫ max(F, 0) v dt is minimised by Simpson's rule: at nodes and half way the
    traction is a variable ≥ 0 and ≥ F, within force and power. The speed is bounded through the
    control points of its parabolas, so also between the nodes. Limits that change with the place
    are stated as v² ≤ V² + 2 b (p − s) before they begin at p (what brakes with b or less and
    keeps to V behind p does that), likewise behind them; a margin of some cm/s is for what lies
    between the nodes, and the curve is checked. CasADi and IPOPT solve it, from the fast curve
    slowed down. Where `timed_curve` takes less, IPOPT starts from that too, and the best of all is
    returned. Discretisation and constraints are our choice.

    Raise ParameterError for less than the fast curve's time, naming that, and ConvergenceError
    if no solution is found.
    """
    course = Course(section, train, driving or Driving())
    quickest = fast_curve(section, train, course.driving)
    if not (math.isfinite(time) and time >= quickest.running_time - 1e-9):
        raise ParameterError(
            f"section '{section.name}' takes '{train.name}' at least "
            f"{quickest.running_time:.3f} s, not {time:g} s"
        )
    if not 0.0 < node < math.inf:
        raise ParameterError(f"node must be a positive time in s, not {node!r}")
    if time < quickest.running_time + 1e-6:
        return quickest
    found = [_solution(course, quickest, time=time, node=node)]
    coasting = timed_curve(section, train, course.driving, time=time)
    if found[0] is None or found[0].energy > coasting.energy:
        found.append(_solution(course, coasting, time=time, node=node))
        if not coasting.violations(section, train, course.driving):
            found.append(coasting)
    curves = [curve for curve in found if curve is not None]
    if not curves:
        raise ConvergenceError(
            f"section '{section.name}' in {time:g} s: no solution was found that keeps the limits "
            f"between its nodes; the fast curve takes {quickest.running_time:.3f} s: give it some "
            "tenths of a second more"
        )
    return min(curves, key=lambda curve: curve.energy)


def _solution(course: Course, start: SpeedCurve, *, time: float, node: float) -> SpeedCurve | None:
    """Return the optimum that IPOPT finds from a curve; None if there is none without violation."""
    for spacing in (node, node / 2.0):  # close to the least time the switching has to be finer
        for margins in MARGINS:
            states = _solve(course, start, time=time, node=spacing, margins=margins)
            if states is None:
                continue
            curve = _curve(states, time, course)
            if not curve.violations(course.section, course.train, course.driving):
                return curve
    return None


Row = tuple[Any, float, float]
"""A constraint: its expression, and the bounds of it."""


class States(NamedTuple):
    """Position, speed and acceleration at the nodes, or half way between them."""

    position: Any
    speed: Any
    acceleration: Any


def _solve(
    course: Course, start: SpeedCurve, *, time: float, node: float, margins: tuple[float, float]
) -> States | None:
    """Return the optimal states at the nodes, None if IPOPT finds none."""
    import casadi as ca

    count = math.ceil(time / node - 1e-9)
    h = time / count
    x = States(*(ca.SX.sym(name, count + 1) for name in States._fields))
    traction = ca.SX.sym("traction", 2 * count + 1)  # at the nodes, then half way
    half = _half_way(_part(x, 0, count), x.acceleration[1:], h)
    points = States(*(ca.vertcat(q, m) for q, m in zip(x, half, strict=True)))
    weights = np.concatenate([[1.0], np.full(count - 1, 2.0), [1.0], np.full(count, 4.0)]) * h / 6.0
    rows = [*_motion(course, x, h), *_forces(course, points, traction, margins[1])]
    rows += [(room, 0.0, ca.inf) for room in _rooms(course, points, margins[0])]
    problem = {
        "x": ca.vertcat(*x, traction),
        "f": ca.dot(weights, traction * points.speed) / 100.0,
        "g": ca.vertcat(*(row for row, _, _ in rows)),
    }
    solver = ca.nlpsol("minimum_energy", "ipopt", problem, QUIET)
    lower, upper = _bounds(course, count, margins[1])
    found = solver(
        x0=_guess(course, start, time, count), lbx=lower, ubx=upper,
        lbg=np.concatenate([np.full(row.numel(), low) for row, low, _ in rows]),
        ubg=np.concatenate([np.full(row.numel(), high) for row, _, high in rows]),
    )  # fmt: skip
    if not solver.stats()["success"]:
        return None
    values = np.array(found["x"]).ravel()
    return States(*values[: 3 * (count + 1)].reshape(3, -1))


def _motion(course: Course, x: States, h: float) -> list[Row]:
    """Return what ties the nodes together, the bound on jerk, and that on the speed between."""
    count = x.speed.numel() - 1
    begin, end = _part(x, 0, count), _part(x, 1, count + 1)
    change = end.acceleration - begin.acceleration
    mean = (begin.acceleration + end.acceleration) / 2.0
    way = h * begin.speed + h * h * (2.0 * begin.acceleration + end.acceleration) / 6.0
    jerk = course.driving.jerk * h
    return [
        (end.speed - begin.speed - h * mean, 0.0, 0.0),
        (end.position - begin.position - way, 0.0, 0.0),
        (change, -jerk, jerk),
        (begin.speed + h / 2.0 * begin.acceleration, 0.0, course.top),
    ]


def _forces(course: Course, at: States, traction: Any, reserve: float) -> list[Row]:
    """Return what binds the traction: the force needed, power, and the train's own curve."""
    import casadi as ca

    pull = at.acceleration + course.resistance(at.speed, at.position)
    rows: list[Row] = [
        (traction - pull, 0.0, ca.inf),
        (traction * at.speed, -ca.inf, (1.0 - reserve) * course.strongest[1]),
    ]
    points = course.train.traction_curve
    if points:
        envelope: Any = points[0][1]
        slope = 0.0
        for (v, force), (later, next_force) in pairwise([*points, (math.inf, points[-1][1])]):
            steeper = (next_force - force) / (later - v)
            envelope = envelope + (steeper - slope) * ca.fmax(at.speed - v, 0.0)
            slope = steeper
        scale = (1.0 - reserve) * course.driving.traction_share / course.inertia
        rows.append((scale * envelope - traction, 0.0, ca.inf))
    return rows


def _bounds(course: Course, count: int, reserve: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds of the unknowns: both ends are fixed but for the final deceleration."""
    length, driving = course.section.length, course.driving
    lower, upper = np.zeros((2, 3, count + 1))
    upper[0], upper[1], upper[2] = length, course.top, np.inf
    lower[2] = -driving.deceleration
    upper[:, 0] = lower[:, 0] = 0.0
    upper[:, -1] = length, 0.0, 0.0
    lower[:, -1] = length, 0.0, -driving.final_deceleration
    force = np.full(2 * count + 1, (1.0 - reserve) * course.strongest[0])
    return (
        np.concatenate([lower.ravel(), np.zeros_like(force)]),
        np.concatenate([upper.ravel(), force]),
    )


def _part(x: States, begin: int, end: int) -> States:
    return States(*(q[begin:end] for q in x))


def _half_way(x: States, later: Any, h: float) -> States:
    """Return the states half way through spans of h (s) that end with acceleration `later`."""
    a = x.acceleration
    return States(
        x.position + h / 2.0 * x.speed + h * h * (5.0 * a + later) / 48.0,
        x.speed + h * (3.0 * a + later) / 8.0,
        (a + later) / 2.0,
    )


def _rooms(course: Course, at: States, below: float) -> list[Any]:
    """Return, for each limit below the highest, how far v² stays below what it allows."""
    import casadi as ca

    def beyond(distance: Any) -> Any:  # max(distance, 0), rounded downwards
        positive = ca.fmax(distance, 0.0)
        return positive * positive / (positive + KINK)

    steepest = max(0.0, *(-slope for _, slope in course.section.gradients)) * GRAVITY_PER_MILLE
    falls, rises = 2.0 * course.driving.deceleration, 2.0 * (course.traction(0.0) + steepest)
    ends = [*(start for start, _ in course.limits[1:]), math.inf]
    rooms = []
    for (start, limit), end in zip(course.limits, ends, strict=True):
        if limit >= course.top:
            continue
        allowed: Any = (limit - below) ** 2
        if start > 0.0:
            allowed = allowed + falls * beyond(start - at.position)
        if end < course.section.length:
            allowed = allowed + rises * beyond(at.position - end)
        rooms.append(allowed - at.speed * at.speed)
    return rooms


def _guess(course: Course, start: SpeedCurve, time: float, count: int) -> np.ndarray:
    """Return a curve, slowed down as a whole, as the first values of the unknowns."""
    share = start.running_time / time
    times = np.linspace(0.0, start.running_time, count + 1)
    at = start.at(np.concatenate([times, (times[:-1] + times[1:]) / 2.0]))
    speed, acceleration = share * at.speed, share * share * at.acceleration
    pull = acceleration + course.resistance(speed, at.position)
    nodes = (q[: count + 1] for q in (at.position, speed, acceleration))
    return np.concatenate([*nodes, np.maximum(pull, 0.0)])


def _curve(states: States, time: float, course: Course) -> SpeedCurve:
    """Return the curve with the solution's accelerations, the stop made exact to rounding."""
    count = len(states.position) - 1
    times = np.linspace(0.0, time, count + 1)
    h = time / count
    a = states.acceleration
    # The stop's speed and position are linear in the accelerations: v = w·a, s = m·a.
    w = np.full(count + 1, h)
    w[[0, -1]] /= 2.0
    m = w * (time - times)
    m[0] -= h * h / 6.0
    m[-1] += h * h / 6.0
    inner = np.stack([w, m])[:, 1:-1]
    miss = np.array([-w @ a, course.section.length - m @ a])
    a = a.copy()
    a[1:-1] += np.linalg.lstsq(inner, miss, rcond=None)[0]
    b, c = a[:-1], a[1:]
    speed = np.concatenate([[0.0], np.cumsum(h * (b + c) / 2.0)])
    position = np.concatenate([[0.0], np.cumsum(h * speed[:-1] + h * h * (2.0 * b + c) / 6.0)])
    names = regimes(course, times, position, speed, a)
    return SpeedCurve.through(times, position, speed, a, names, course)
